"""The camera `heptarm` of LeRobot: pictures of a connected robot of the type heptarm, and of its scene.

`--robot.cameras="{front: {type: heptarm, width: 96, height: 96, fps: 15}}"`
"""

from lerobot_camera_heptarm.camera import HeptarmCamera, HeptarmCameraConfig

__all__ = ["HeptarmCamera", "HeptarmCameraConfig"]
