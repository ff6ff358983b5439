"""Addresses of the network at the lab, replaced by addresses that this machine has.

Applications name their peers by fixed addresses. These are in string literals of the sources, in process data and in
the settings of FRI sessions; an application also compares them with those of the peers that connect. So the text is
replaced, rather than the connection redirected.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

_HOST = re.compile(r"[\w.-]+")


@dataclass(frozen=True, slots=True)
class AddressMap:
    """Addresses or host names, each with the one that takes its place.

    Attributes:
        replaced: new addresses by old ones.
    """

    replaced: Mapping[str, str]

    @classmethod
    def of(cls, texts: Iterable[str]) -> AddressMap:
        """The map of texts OLD=NEW, such as "172.31.1.25=127.0.0.1".

        Raises:
            ValueError: a text is not of that form, or an address is mapped twice.
        """
        found: dict[str, str] = {}
        for text in texts:
            old, _, new = (part.strip() for part in text.partition("="))
            if not _HOST.fullmatch(old) or not _HOST.fullmatch(new):
                raise ValueError(f"--map must be ADDRESS=ADDRESS, as in 172.31.1.25=127.0.0.1; got {text!r}")
            if old in found:
                raise ValueError(f"--map: {old} is mapped twice, to {found[old]} and to {new}")
            found[old] = new
        return cls(found)

    def apply(self, text: str) -> str:
        """A text with every address replaced that stands there as a whole: 172.31.1.2 is not found in 172.31.1.25."""
        if not self.replaced:
            return text
        names = "|".join(map(re.escape, sorted(self.replaced, key=len, reverse=True)))
        pattern = rf"(?<![\w.-])(?:{names})(?![\w-]|\.\w)"
        return re.sub(pattern, lambda match: self.replaced[match[0]], text)

    def unused(self, texts: Iterable[str]) -> list[str]:
        """The old addresses that are in none of the texts."""
        left = dict.fromkeys(self.replaced)
        for text in texts:
            for old in [address for address in left if AddressMap({address: ""}).apply(text) != text]:
                del left[old]
        return list(left)
