"""The page around viser's: a bar with STOP that nothing covers and nothing scrolls away, and viser's page below it.

viser lays out its own panels: they scroll, fold and move to the bottom of a phone. A button that stops an arm may do
none of that, so it is no button of viser's. The bar is HTML of ours, viser's page is a frame below it, and a press is a
request of its own to this server. It works as well while viser's page still loads or has lost its connection.
"""

from __future__ import annotations

#: Paths of this server: viser's own page, and the request that stops every arm.
VIEW_PATH, STOP_PATH = "/index.html", "/stop"

_STYLE = """
html,body{margin:0;height:100%;overflow:hidden;overscroll-behavior:none;background:#141517;color:#dee2e6;
font-family:system-ui,sans-serif}
body.light{background:#fff;color:#212529}
body{display:flex;flex-direction:column}
header{flex:none;display:flex;align-items:stretch;gap:12px;padding:4px 6px;box-sizing:border-box;
padding-top:max(4px,env(safe-area-inset-top))}
#stop{flex:1 1 60%;min-height:52px;border:0;border-radius:6px;background:#e03131;color:#fff;
font:800 24px system-ui,sans-serif;letter-spacing:.25em;cursor:pointer;
touch-action:none;user-select:none;-webkit-user-select:none;-webkit-touch-callout:none}
#stop:hover{background:#c92a2a}#stop:active{background:#a61e1e}
#stop:focus-visible{outline:3px solid #ffd43b;outline-offset:-5px}
#said{flex:1 1 40%;align-self:center;max-height:52px;overflow:hidden;font-size:14px;line-height:1.25}
#said.bad{color:#ff6b6b;font-weight:700}
iframe{flex:1;width:100%;border:0;min-height:0}
"""

# A press begins with pointerdown; "click" is for keyboards and for aids that send nothing else.
_SCRIPT = """
const [stop, said, view] = ["stop", "said", "view"].map((name) => document.getElementById(name));
let pressed = 0;
async function halt() {
  const number = ++pressed;
  let words = "STOP did not reach the panel: press the emergency stop", bad = true;
  try {
    const answer = await fetch("STOP_PATH", {cache: "no-store", credentials: "same-origin"});
    words = await answer.text();
    bad = !answer.ok;
  } catch (_) {}
  if (number !== pressed) return;
  said.textContent = new Date().toLocaleTimeString([], {hour12: false}) + " " + words;
  said.className = bad ? "bad" : "";
}
stop.addEventListener("pointerdown", (event) => { event.preventDefault(); stop.focus(); halt(); });
stop.addEventListener("click", (event) => { if (event.detail === 0) halt(); });
stop.addEventListener("contextmenu", (event) => event.preventDefault());
function onKey(event) {
  const writes = event.target.matches("textarea, input:not([type=range]):not([type=checkbox])");
  if (event.ctrlKey || event.metaKey || event.altKey || event.repeat || writes) return;
  if (event.key.toLowerCase() === "s") halt();
}
document.addEventListener("keydown", onKey);
view.addEventListener("load", () => view.contentDocument.addEventListener("keydown", onKey, true));
"""


def page(*, light: bool) -> str:
    """The page: the bar, and viser's page below it.

    Args:
        light: a light page instead of a dark one.
    """
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8"><title>heptarm</title>'
        '<meta name="viewport" content="width=device-width, initial-scale=1, viewport-fit=cover">'
        f"<style>{_STYLE}</style></head>"
        f'<body class="{"light" if light else "dark"}"><header>'
        '<button id="stop" aria-describedby="said">STOP</button>'
        '<div id="said" role="status">stops every arm of this page (key S); no emergency stop</div>'
        f'</header><iframe id="view" src="{VIEW_PATH}" title="arms"></iframe>'
        f"<script>{_SCRIPT.replace('STOP_PATH', STOP_PATH)}</script></body></html>"
    )
