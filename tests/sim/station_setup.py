"""A station setup as Sunrise Workbench writes it, as far as heptarm reads it."""

from __future__ import annotations


def setup(
    item: str = "com.kuka/LBR5_7kg",
    name: str = "LBR_iiwa_7_R800_1",
    flange: tuple[str, str] | None = ("Medien-Flansch Touch elektrisch", "MADA=MFT&amp;IOConfig=MFT"),
    software: dict[str, str] | None = None,
) -> str:
    chosen = ""
    if flange is not None:
        chosen = (
            '<Property displayName="Medien-Flansch" key="MAM" type="String">'
            f'<Value displayName="{flange[0]}">{flange[1]}</Value>'
            '<PossibleValue displayName="None (M0)">MADA=M0&amp;IOConfig=Default</PossibleValue></Property>'
        )
    items = "".join(
        f'<SoftwareItem itemPath="com.kuka/{path}" selectedVersion="{version}"/>'
        for path, version in (software or {}).items()
    )
    return (
        '<?xml version="1.0" encoding="UTF-8" standalone="no"?><ConfigurationProject>'
        '<TopologyItem itemPath="com.kuka/Project" name="Project">'
        '<TopologyItem itemPath="com.kuka/ControllerLBR5" name="KUKA_Sunrise_Cabinet_1">'
        f'<TopologyItem itemPath="{item}" name="{name}">{chosen}</TopologyItem>'
        f"{items}</TopologyItem></TopologyItem></ConfigurationProject>"
    )
