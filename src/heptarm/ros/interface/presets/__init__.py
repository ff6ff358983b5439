"""The interfaces of other ROS drivers, which the parameter `names` adds to heptarm's own: iiwa_stack and libiiwa.

Their topics, services and actions call the same verbs as heptarm's. The table of all names is in
`heptarm.ros.interface.names`; both nodes publish its messages in their own `presets.py`.
"""
