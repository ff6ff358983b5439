"""The panel: a page in the browser for looking at arms and moving them by hand.

`model` is what the panel knows about an arm and does to it, through the arm's public verbs; `jog` moves it while a
button is held, `points` keeps what was taught. `page` draws all of that with viser, `drawing` what is in space, `guard`
lets only those in who have the URL, and `process` is the program. States come in by polling; nothing here holds up the
state stream.
"""
