"""Installs the node for colcon; heptarm itself comes from pip."""

from glob import glob

from setuptools import setup

setup(
    name="heptarm_ros2",
    version="0.1.0",
    packages=["heptarm_ros2"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/heptarm_ros2"]),
        ("share/heptarm_ros2", ["package.xml"]),
        ("share/heptarm_ros2/launch", glob("launch/*.launch.py")),
        ("share/heptarm_ros2/config", glob("config/*.yaml")),
    ],
    install_requires=["setuptools", "heptarm"],
    zip_safe=True,
    maintainer="The heptarm developers",
    maintainer_email="heptarm@example.org",
    description="The heptarm node: a KUKA LBR iiwa in ROS 2, real or virtual",
    license="Apache-2.0",
    entry_points={
        "console_scripts": ["heptarm_node = heptarm_ros2.main:main", "reach = heptarm_ros2.reach:main"]
    },
)
