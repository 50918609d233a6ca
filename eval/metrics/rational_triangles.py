"""Whether two triangles intersect, in whole numbers of any size: for the pairs that rounding leaves open."""

from __future__ import annotations

APART, CROSSING, COPLANAR = 0, 1, 2

Point = tuple[int, ...]
Triangle = tuple[Point, Point, Point]


def triangles_meet(a: list[list[float]], b: list[list[float]]) -> int:
    """APART if the closed triangles have no common point, else CROSSING, or COPLANAR if in one plane.

    a, b: three corners of three coordinates. Every float is a whole number over a power of two; all are taken
    times the largest of these, so the answer is exact.
    Closed triangles meet if and only if an edge of one meets the other. A triangle of no area has no plane:
    it is met as three segments, and never by another such triangle.
    """
    first, second = _whole(a, b)
    thin_a, thin_b = _normal(first) == (0, 0, 0), _normal(second) == (0, 0, 0)
    if thin_a and thin_b:
        return APART
    meets = (not thin_b and any(_meets(*edge, second) for edge in _edges(first))) or (
        not thin_a and any(_meets(*edge, first) for edge in _edges(second))
    )
    if not meets:
        return APART
    flat = not thin_a and not thin_b and all(_height(p, second) == 0 for p in first)
    return COPLANAR if flat else CROSSING


def _whole(a: list[list[float]], b: list[list[float]]) -> tuple[Triangle, Triangle]:
    """Both triangles at one scale that makes every coordinate a whole number."""
    ratios = [[x.as_integer_ratio() for x in corner] for corner in (*a, *b)]
    scale = max(below for corner in ratios for _, below in corner)
    p, q, r, s, t, u = (tuple(above * (scale // below) for above, below in corner) for corner in ratios)
    return (p, q, r), (s, t, u)


def _edges(t: Triangle) -> list[tuple[Point, Point]]:
    return [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]


def _meets(p: Point, q: Point, t: Triangle) -> bool:
    """Whether the closed segment pq meets the closed triangle t of some area."""
    over_p, over_q = _height(p, t), _height(q, t)
    if over_p * over_q > 0:
        return False
    if over_p == over_q == 0:
        return _meets_in_plane(p, q, t)
    turns = [_height(q, (p, s, e)) for s, e in _edges(t)]
    return all(x >= 0 for x in turns) or all(x <= 0 for x in turns)


def _meets_in_plane(p: Point, q: Point, t: Triangle) -> bool:
    normal = _normal(t)
    dropped = max(range(3), key=lambda k: abs(normal[k]))
    kept = [k for k in range(3) if k != dropped]

    def side(o: Point, x: Point, y: Point) -> int:
        i, j = kept
        return (x[i] - o[i]) * (y[j] - o[j]) - (x[j] - o[j]) * (y[i] - o[i])

    for point in (p, q):
        turns = [side(s, e, point) for s, e in _edges(t)]
        if all(x >= 0 for x in turns) or all(x <= 0 for x in turns):
            return True
    # Both ends are outside, so the segment meets the triangle only if it crosses one of the sides properly
    # or through a corner; lying along a side it would have passed a corner of it.
    for s, e in _edges(t):
        ends, corners = side(p, q, s) * side(p, q, e), side(s, e, p) * side(s, e, q)
        if ends <= 0 and corners <= 0 and (ends < 0 or corners < 0 or _overlap(p, q, s, e)):
            return True
    return False


def _overlap(p: Point, q: Point, s: Point, e: Point) -> bool:
    """Whether two segments have a common point, given that neither parts the ends of the other."""
    return all(
        max(min(p[k], q[k]), min(s[k], e[k])) <= min(max(p[k], q[k]), max(s[k], e[k])) for k in range(3)
    )


def _height(p: Point, t: Triangle) -> int:
    n = _normal(t)
    return sum(n[k] * (p[k] - t[0][k]) for k in range(3))


def _normal(t: Triangle) -> Point:
    u, v = _minus(t[1], t[0]), _minus(t[2], t[0])
    return (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])


def _minus(p: Point, q: Point) -> Point:
    return tuple(x - y for x, y in zip(p, q, strict=True))
