// Fill the list of versions from versions.json, which scripts/publish_site.py writes beside the folders of the versions.
// A site that is not published has no such file: the list stays hidden.
document.addEventListener("DOMContentLoaded", async () => {
  const list = document.querySelector(".site-versions");
  const root = new URL(document.documentElement.dataset.content_root || "./", location.href);
  if (!list || !location.protocol.startsWith("http")) return;
  const answer = await fetch(new URL("../versions.json", root)).catch(() => null);
  if (!answer || !answer.ok) return;
  const select = list.querySelector("select");
  const here = root.pathname.split("/").at(-2);
  for (const version of await answer.json()) {
    select.add(new Option(version, version, false, version === here));
  }
  select.addEventListener("change", async () => {
    const other = new URL(`../${select.value}/`, root);
    const page = new URL(location.pathname.slice(root.pathname.length), other);
    const known = await fetch(page, { method: "HEAD" }).catch(() => null);
    location.href = known && known.ok ? page : other; // a page that this version lacks: its first one
  });
  list.hidden = false;
});
