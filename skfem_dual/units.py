"""Units: what comes in, and what engineers read."""

import re
from dataclasses import dataclass, field

from .arguments import checked_choice, checked_text

#: in metres, and whether metric
LENGTHS = {
    "mm": (0.001, True),
    "cm": (0.01, True),
    "m": (1.0, True),
    "in": (0.0254, False),
    "ft": (0.3048, False),
}
#: in newtons, and whether metric
FORCES = {
    "N": (1.0, True),
    "kN": (1e3, True),
    "MN": (1e6, True),
    "lbf": (4.4482216152605, False),
    "kip": (4448.2216152605, False),
}
SQUARE_FOOT = 0.3048**2
#: mN and mPa, which are hardly meant
THOUSANDTHS = re.compile(r"\s*m(?i:n|pa)")
#: what stands between the units of a product, and before powers
PRODUCT = re.compile(r"[\s·⋅*^]|(?<=[A-Za-z])[.-](?=[A-Za-z])")
#: in pascals, beside forces over squares of lengths
PRESSURES = {
    "Pa": 1.0,
    "kPa": 1e3,
    "MPa": 1e6,
    "GPa": 1e9,
    "psf": FORCES["lbf"][0] / SQUARE_FOOT,
    "ksf": FORCES["kip"][0] / SQUARE_FOOT,
    "psi": FORCES["lbf"][0] / 0.0254**2,
    "ksi": FORCES["kip"][0] / 0.0254**2,
}


@dataclass(frozen=True)
class Unit:
    """A unit to read, and what a number is multiplied by to be in it.

    Attributes
    ----------
    symbol : str
        As it is written.
    factor : float
        From consistent units to it.
    """

    symbol: str
    factor: float = 1.0


@dataclass(frozen=True)
class Units:
    """Units of force and length of all numbers that go in, and units of those that come out.

    Parameters
    ----------
    text : str
        ``"kN,m"``, ``"N,mm"`` or ``"kip,ft"``, force first: N, kN, MN with mm, cm, m; lbf, kip
        with in, ft. Capitals count only where ``mN`` would be thousandths. Moduli and pressures
        that go in are forces per length squared. Empty for any consistent units, named F and L.

    Raises
    ------
    TypeError
        If ``text`` is no text.
    ValueError
        If a unit is not known, or one is metric and the other not.

    Examples
    --------
    >>> units = Units("kN,m")
    >>> units.displacement.symbol, 0.0125 * units.displacement.factor
    ('mm', 12.5)
    >>> Units("kip,ft").pressure
    Unit(symbol='ksf', factor=1.0)

    Notes
    -----
    ``length``, ``area``, ``force`` and ``moment`` are units as they go in. ``displacement``,
    ``slope``, ``pressure`` and ``modulus`` are mm, per mille, kPa and MPa, or in, per mille, ksf
    and ksf. ``strength`` is that of pressures times the square root of a length, as they go in.
    """

    text: str = ""
    length: Unit = field(init=False)
    area: Unit = field(init=False)
    force: Unit = field(init=False)
    moment: Unit = field(init=False)
    displacement: Unit = field(init=False)
    slope: Unit = field(init=False)
    pressure: Unit = field(init=False)
    modulus: Unit = field(init=False)
    strength: Unit = field(init=False)

    def __post_init__(self) -> None:
        checked_text("units", self.text)
        found = NAMELESS
        if self.text:
            force, length = _symbols(self.text)
            object.__setattr__(self, "text", f"{force},{length}")
            found = _read(force, length)
        for name, unit in found.items():
            object.__setattr__(self, name, unit)

    @property
    def named(self) -> bool:
        """Whether the units are known."""
        return bool(self.text)

    def factor(self, symbol: str, quantity: str) -> float:
        """What numbers in another unit are multiplied by to go in.

        Parameters
        ----------
        symbol : str
            Such as MPa, kN/m², cm, kNm or kip-ft.
        quantity : {"length", "force", "pressure", "moment"}
            What it measures.

        Raises
        ------
        TypeError, ValueError
            If it measures something else or is not known, or these units have no names.

        Examples
        --------
        >>> Units("kN,m").factor("MN/m2", "pressure")
        1000.0
        """
        symbol = checked_text("symbol", symbol)
        names = {
            "length": self.length.symbol,
            "force": self.force.symbol,
            "pressure": f"{self.force.symbol}/{self.length.symbol}2",
            "moment": self.force.symbol + self.length.symbol,
        }
        checked_choice("quantity", quantity, names)
        if not self.named:
            raise ValueError('expected known units, such as Units("kN,m"), got Units()')
        known, own = _sizes(quantity), names[quantity]
        wanted = PRODUCT.sub("", symbol.replace("²", "2")).casefold()
        if wanted not in known:
            raise ValueError(f"expected a unit of {quantity} such as {own}, got {symbol!r}")
        if THOUSANDTHS.match(PRODUCT.sub("", symbol)):
            raise ValueError(
                f"expected a unit of {quantity} such as {own}, got {symbol!r}, thousandths. "
                "Remedy: millions have a capital M"
            )
        return known[wanted] / known[own.casefold()]


def _sizes(quantity: str) -> dict[str, float]:
    """Units of a quantity in lower case, by what they are in N and m."""
    lengths = {name: size for name, (size, _) in LENGTHS.items()}
    forces = {name: size for name, (size, _) in FORCES.items()}
    every = [(a, b, f, x) for a, f in forces.items() for b, x in lengths.items()]
    sizes = {
        "length": lengths,
        "force": forces,
        "pressure": PRESSURES | {f"{a}/{b}2": f / x**2 for a, b, f, x in every},
        "moment": {a + b: f * x for a, b, f, x in every},
    }[quantity]
    return {name.casefold(): size for name, size in sizes.items()}


NAMELESS = {
    "length": Unit("L"),
    "area": Unit("L²"),
    "force": Unit("F"),
    "moment": Unit("F·L"),
    "displacement": Unit("L"),
    "slope": Unit("rad"),
    "pressure": Unit("F/L²"),
    "modulus": Unit("F/L²"),
    "strength": Unit("F/L^1.5"),
}


def _symbols(text: str) -> tuple[str, str]:
    """Units of force and length as they are written here, from any capitals."""
    force, _, length = (part.strip() for part in text.partition(","))
    if THOUSANDTHS.match(force):
        raise ValueError(
            f"expected units FORCE,LENGTH such as kN,m, got {text!r}, thousandths of a newton. "
            "Remedy: MN for millions"
        )
    found = [
        next((name for name in known if name.casefold() == part.casefold()), None)
        for part, known in ((force, FORCES), (length, LENGTHS))
    ]
    if found[0] is None or found[1] is None:
        raise ValueError(
            f"expected units FORCE,LENGTH of {', '.join(FORCES)} and {', '.join(LENGTHS)}, such "
            f"as kN,m, got {text!r}"
        )
    if FORCES[found[0]][1] != LENGTHS[found[1]][1]:
        raise ValueError(f"expected both units metric or both not, such as kip,ft, got {text!r}")
    return found[0], found[1]


def _read(force: str, length: str) -> dict[str, Unit]:
    (newtons, metric), (metres, _) = FORCES[force], LENGTHS[length]
    pascals = newtons / metres**2
    if metric:
        displacement = Unit("mm", metres / 1e-3)
        pressure, modulus = Unit("kPa", pascals / 1e3), Unit("MPa", pascals / 1e6)
    else:
        displacement = Unit("in", metres / 0.0254)
        pressure = modulus = Unit("ksf", pascals / (FORCES["kip"][0] / SQUARE_FOOT))
    return {
        "length": Unit(length),
        "area": Unit(f"{length}²"),
        "force": Unit(force),
        "moment": Unit(f"{force}·{length}"),
        "displacement": displacement,
        "slope": Unit("‰", 1e3),
        "pressure": pressure,
        "modulus": modulus,
        "strength": Unit(f"{force}/{length}^1.5"),
    }


#: any consistent units
PLAIN = Units()
