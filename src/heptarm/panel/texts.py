"""The panel's readouts as HTML: pure functions of what the model has read. Every text from outside is escaped."""

from __future__ import annotations

import time
from collections.abc import Mapping
from html import escape

import numpy as np

from heptarm.io.panel_box import PlanOutline
from heptarm.panel.model import Advice, Readout
from heptarm.panel.points import PointList
from heptarm.panel.wizard import WizardStep
from heptarm.values.checks import Array
from heptarm.values.io import SignalValue
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel
from heptarm.values.state import State, Wrench
from heptarm.values.text import fixed

#: Inputs that are listed; a project may have hundreds.
MOST_SIGNALS = 60
#: The look of the panel. `:has` finds the containers and buttons beside the panel's own marks. On a phone viser puts
#: all controls on a narrow sheet over the picture, and on an upright tablet it leaves the picture a strip between two
#: panels: there the picture is above, and what jogs below it.
STYLE = """<style>
.ha{font-size:13px;line-height:1.35;padding:2px 12px 6px;font-variant-numeric:tabular-nums}
.ha h4{margin:8px 0 3px;font-size:11px;letter-spacing:.08em;text-transform:uppercase;opacity:.6;font-weight:600}
.ha .title{font-size:16px;font-weight:650;margin-right:6px}
.ha .chip{display:inline-block;border-radius:9px;padding:0 8px;margin:1px 2px 1px 0;background:#8883;font-size:12px}
.ha .good{background:#2f9e4440}.ha .warn{background:#f59f0045}.ha .bad{background:#e0313155}
.ha .row{display:grid;grid-template-columns:22px 1fr 54px 60px 56px;gap:5px;align-items:center;height:21px}
.ha .row span{text-align:right;white-space:nowrap}.ha .row b{opacity:.75;font-weight:600}
.ha .unit{opacity:.55;font-size:11px}
.ha .bar{position:relative;height:8px;border-radius:4px;background:#8884;min-width:40px}
.ha .bar i{position:absolute;top:-3px;width:6px;height:14px;border-radius:3px;margin-left:-3px}
.ha .bar u{position:absolute;top:0;height:8px;width:1px;background:#8889}
.ha .six{display:grid;grid-template-columns:repeat(3,1fr);gap:2px 8px}
.ha .six div{display:flex;justify-content:space-between;border-bottom:1px solid #8882}
.ha .six div b{opacity:.6;font-weight:600}
.ha .big{font-size:24px;font-weight:650}
.ha .box{border-radius:6px;padding:5px 9px;margin:3px 0;background:#8882;border-left:4px solid #888}
.ha .box.good{border-color:#2f9e44}.ha .box.warn{border-color:#f59f00}.ha .box.bad{border-color:#e03131}
.ha .box small{display:block;opacity:.8}
.ha.head{min-height:48px}.ha.news{height:112px;overflow-y:auto}
.ha table{width:100%;border-collapse:collapse}.ha td{padding:1px 4px;border-bottom:1px solid #8882}
.ha .on{color:#40c057}.ha .here{background:#ff6b0a33}
div:has(> div > .ha-grid){display:grid;grid-template-columns:1fr 1fr}
div:has(> div > .ha-grid) > div:not(:has(> button)){grid-column:1/-1}
div:has(> div > .ha-grid) > div:has(> button){margin-left:4px;margin-right:4px}
div:has(> div > .ha-grid) > div > button{height:2.4em !important;touch-action:none;user-select:none;
-webkit-user-select:none;-webkit-touch-callout:none}
div:has(> .ha-wide) + div:has(> button){grid-column:1/-1}
#webgl-software-rendering{display:none}
@media (min-width:36.01em) and (max-width:1023px) and (orientation:portrait){
[data-dock-root] > div:not([data-dock-region]):has(canvas){inset:0 0 65% 0 !important}
[data-dock-root] > [data-dock-region]{top:35% !important;width:50% !important}
[data-dock-root] > div:not([data-dock-region]):not(:has(canvas)){box-shadow:none !important}
[data-dock-region] > div > div:has(> [data-dock-column]){width:100% !important}
[data-dock-region-resize]{display:none}
}
@media (max-width:1023px) and (orientation:portrait){
div:has(> div > .ha-grid){grid-template-columns:repeat(3,minmax(0,1fr))}
div:has(> div > .ha-grid) > div > button{padding-inline:4px !important}
}
@media ((max-width:1023px) and (orientation:portrait)) or (max-height:799px){
div:has(> div > .ha-keys){grid-template-columns:repeat(4,minmax(0,1fr))}
.ha.head{min-height:0}.ha.news{height:60px}
}
@media (max-width:36em){
#root:has(div[style*="width: 20em"] > div:last-child:not([style*="display: none"])) [data-dock-root] > div:has(canvas){
bottom:70% !important}
.mantine-Paper-root:has(> div > div > div > div > div[style*="width: 20em"]){
width:100% !important;max-height:70% !important}
.mantine-Paper-root div[style*="width: 20em"]{width:100% !important}
.mantine-Paper-root div[style*="width: 20em"] > div:first-child{height:2.2em !important}
}
</style>"""
GRID, KEYS, WIDE = (f'<div class="ha-{names}"></div>' for names in ("grid", "grid ha-keys", "wide"))
_LEVELS = {"info": "good", "warning": "warn", "error": "bad"}


def _chip(text: str, kind: str = "") -> str:
    return f'<span class="chip {kind}">{escape(text)}</span>'


def head(readout: Readout) -> str:
    """Robot, connection, mode and who controls."""
    chips = [_chip("virtual") if readout.is_virtual else _chip("real robot", "warn")]
    state = readout.state
    if not readout.is_connected:
        chips.append(_chip("no connection", "bad"))
    elif state is not None and state.groups.safety is not None:
        safety = state.groups.safety
        chips.append(_chip(safety.mode.value.upper()) if safety.is_known else _chip("safety unknown", "warn"))
        if safety.is_known:
            chips.append(_chip("ready", "good") if safety.ready_to_move else _chip("stands", "warn"))
    if readout.in_control:
        chips.append(_chip("in control: this panel", "good"))
    else:
        chips.append(_chip(f"in control: {readout.controller or 'nobody'}"))
    if readout.is_jogging:
        chips.append(_chip(f"jogging, slowed: {readout.slowed}" if readout.slowed else "jogging", "warn"))
    if readout.running:
        chips.append(_chip(f"to {readout.running}", "warn"))
    if readout.recording:
        chips.append(_chip("● recording", "bad"))
    return f'<div class="ha head"><span class="title">{escape(readout.title)}</span>{"".join(chips)}</div>'


def _box(advice: Advice, kind: str, before: str = "") -> str:
    remedy = f"<small>{escape(advice.remedy)}</small>" if advice.remedy else ""
    return f'<div class="box {kind}">{before}{escape(advice.what)}{remedy}</div>'


def safety(readout: Readout) -> str:
    """Why the arm stands, with the remedy; the last stop; the outcome of the last action.

    They take the same place whether they are few or many: no button below moves from under somebody's finger.
    """
    boxes = [_box(stand, "warn") for stand in readout.stands]
    if not readout.is_connected:
        boxes = [
            _box(Advice("The connection to the cabinet is lost", "Check the cabinet; then Recover."), "bad")
        ]
    last = readout.last_stop
    if last is not None and not boxes:
        at = time.strftime("%H:%M:%S", time.localtime(last.at))
        boxes.append(_box(Advice(last.what), "", f"Last stop {at}: "))
    if readout.message is not None:
        boxes.append(_box(readout.message, _LEVELS[readout.message.level]))
    return f'<div class="ha news">{"".join(boxes)}</div>'


def _colour(load: float) -> str:
    """Colour of a load, a fraction of the largest: blue, from a half on orange, from 0.85 on red."""
    return "#4dabf7" if load < 0.5 else "#ff922b" if load < 0.85 else "#fa5252"


def plan(outline: PlanOutline | None) -> str:
    """What the ghost shows."""
    if outline is None:
        return ""
    length = float(np.linalg.norm(np.diff(outline.path, axis=0), axis=1).sum())
    count = len(outline.touches)
    touches = f"<small>bodies would touch at {count} place{'s' * (count > 1)}</small>" if count else ""
    return (
        f'<div class="ha"><div class="box {"bad" if count else ""}">Plan: {fixed(float(outline.t[-1]), 2)} s, '
        f"{fixed(1e3 * length, 0)} mm; nothing moves{touches}</div></div>"
    )


def joints(state: State | None, robot: RobotModel) -> str:
    """A bar for each joint between its limits, coloured by its load, with angle, speed and torque."""
    if state is None or state.groups.joints is None:
        return '<div class="ha"><h4>Joints</h4>no state received</div>'
    tau = np.zeros(7) if state.groups.torques is None else state.tau
    dq = np.nan_to_num(state.dq)
    places = ((state.q - robot.q_min) / (robot.q_max - robot.q_min)).clip(0.0, 1.0)
    rows = []
    for index in range(7):
        load = abs(float(tau[index])) / float(robot.tau_max[index])
        low, high = np.degrees((robot.q_min[index], robot.q_max[index]))
        rows.append(
            f'<div class="row" title="{low:.0f} to {high:.0f} deg"><b>A{index + 1}</b>'
            f'<div class="bar"><u style="left:50%"></u>'
            f'<i style="left:{100 * places[index]:.1f}%;background:{_colour(load)}"></i></div>'
            f'<span>{fixed(np.degrees(state.q[index]), 1)}<span class="unit">°</span></span>'
            f'<span>{fixed(np.degrees(dq[index]), 1)}<span class="unit"> °/s</span></span>'
            f'<span>{fixed(tau[index], 1)}<span class="unit"> Nm</span></span></div>'
        )
    return f'<div class="ha"><h4>Joints</h4>{"".join(rows)}</div>'


def _six(names: str, values: Array, places: int, unit: str) -> str:
    cells = (
        f'<div><b>{name}</b><span>{fixed(value, places)} <span class="unit">{unit}</span></span></div>'
        for name, value in zip(names.split(), values, strict=True)
    )
    return "".join(cells)


def place(tcp: Pose | None, state: State | None) -> str:
    """Pose of the motion frame in millimetres and degrees."""
    if tcp is None or state is None:
        return ""
    control = state.groups.mode
    frame = "flange" if control is None else control.frame
    tool = "" if control is None or not control.tool else f" of {control.tool}"
    return (
        f'<div class="ha"><h4>TCP: {escape(frame)}{escape(tool)}, in the base</h4><div class="six">'
        f"{_six('X Y Z', tcp.xyz * 1e3, 1, 'mm')}{_six('A B C', np.degrees(tcp.abc), 1, '°')}</div></div>"
    )


def wrench(load: Wrench | None, undeclared: float) -> str:
    """External force and torque at the motion frame, base axes, and what they leave out.

    Args:
        load: without what is undeclared; None: not known.
        undeclared: weight on the flange that no load data state [N].
    """
    if load is None:
        return ""
    beside = f"beside the tool's {undeclared:.1f} N: attach it" if undeclared else ""
    doubt = "" if load.valid() else _chip("inaccurate here", "warn")
    return (
        f'<div class="ha"><h4>External force at the TCP</h4><span class="big">'
        f'{np.linalg.norm(load.force):.1f}</span> <span class="unit">N {beside}</span> {doubt}'
        f'<div class="six">{_six("Fx Fy Fz", load.force, 1, "N")}{_six("Tx Ty Tz", load.torque, 2, "Nm")}</div></div>'
    )


def wizard(step: WizardStep) -> str:
    """What the wizard asks, what moves next, how far it is, and what it has found."""
    boxes = []
    if step.asks:
        boxes.append(f'<div class="box warn">{_lines(step.asks)}</div>')
    elif step.is_running:
        done = f"{step.done} of {step.count}" if step.count else "it begins"
        boxes.append(f'<div class="box">Measuring: {done}</div>')
    if step.count:
        width = 100.0 * min(step.done / step.count, 1.0)
        boxes.append(
            '<div class="bar"><i style="left:0;top:0;height:8px;margin:0;background:#2f9e44;'
            f'width:{width:.0f}%"></i></div>'
        )
    if step.result:
        saved = (
            "<small>saved</small>"
            if step.is_saved
            else "<small>nothing is changed before you save it</small>"
        )
        boxes.append(f'<div class="box good">{_lines(step.result)}{saved}</div>')
    return f'<div class="ha">{"".join(boxes)}</div>'


def _lines(text: str) -> str:
    return escape(text).replace("\n", "<br>")


def signals(inputs: Mapping[str, SignalValue]) -> str:
    """Inputs with their values."""
    rows = []
    for name, value in list(inputs.items())[:MOST_SIGNALS]:
        shown = (
            ('<span class="on">●</span> on' if value else "○ off")
            if isinstance(value, bool)
            else f"{value:g}"
        )
        rows.append(f"<tr><td>{escape(name)}</td><td>{shown}</td></tr>")
    left_out = len(inputs) - MOST_SIGNALS
    more = f"<small>and {left_out} more</small>" if left_out > 0 else ""
    empty = "" if inputs else "this cabinet has no inputs"
    return f'<div class="ha"><h4>Inputs</h4><table>{"".join(rows)}</table>{empty}{more}</div>'


def program(points: PointList, chosen: str, running: str) -> str:
    """The list of taught points."""
    rows = []
    for number, point in enumerate(points, 1):
        mark = "▶" if point.name == running else "●" if point.name == chosen else ""
        kind = ' class="here"' if point.name == running else ""
        angles = " ".join(fixed(value, 0) for value in np.degrees(point.q))
        rows.append(
            f"<tr{kind}><td>{mark}</td><td>{number}</td><td><b>{escape(point.name)}</b></td>"
            f"<td>{'LIN' if point.straight else 'PTP'}</td><td>{angles}</td></tr>"
        )
    body = f"<table>{''.join(rows)}</table>" if rows else "Move the arm to a place and press Teach."
    return f'<div class="ha"><h4>Taught points</h4>{body}</div>'
