"""Three-vectors as tuples, for what a drawing needs of them."""

from imucal_wizard.guide.operator_view import Matrix, Vector


def scaled(v: Vector, by: float) -> Vector:
    """A vector times a number."""
    return v[0] * by, v[1] * by, v[2] * by


def total(*vectors: Vector) -> Vector:
    """The sum of vectors."""
    x, y, z = (sum(v[i] for v in vectors) for i in range(3))
    return x, y, z


def cross(a: Vector, b: Vector) -> Vector:
    """The vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def unit(index: int, sign: float = 1.0) -> Vector:
    """Along an axis, or against it."""
    values = [0.0, 0.0, 0.0]
    values[index] = sign
    return values[0], values[1], values[2]


def standing(up: Vector, right: Vector) -> Matrix:
    """The attitude (body to world) with two body directions, at right angles, up and right."""
    return right, cross(up, right), up


def across(v: Vector, up: Vector) -> Vector:
    """The part of a vector at right angles to a unit vector, of length one."""
    along = sum(a * b for a, b in zip(v, up, strict=True))
    rest = total(v, scaled(up, -along))
    return scaled(rest, 1.0 / sum(value * value for value in rest) ** 0.5)
