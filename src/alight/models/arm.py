"""The robot: kinematics and dynamics (1), (2), (5), (9)-(11)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Annotated, ClassVar, Literal

from alight.errors import UnknownName, Unreachable
from alight.models.rigid_body import christoffel
from alight.symbolic.derive import jacobian, time_derivative
from alight.symbolic.ops import (
    Matrix,
    Vector,
    arccos,
    arctan2,
    as_vector,
    cos,
    inverse,
    matrix,
    sin,
    sqrt,
    tanh,
    vector,
)
from alight.symbolic.parameters import (
    NonNegative,
    NonNegativePair,
    Positive,
    Quantity,
    parameters,
    rebind,
)

Elbow = Literal["+", "-"]
"""Sign of the second joint angle."""


class Arm(ABC):
    """An arm with two joints whose tip moves in a plane.

    A concrete arm states `x_r`, `M` and `h`; the Jacobian, the Coriolis matrix and everything in
    task space follow by differentiation.
    """

    inertial: ClassVar[tuple[str, ...]]
    """Names of the parameters in which ``M`` is linear."""

    @property
    @abstractmethod
    def gravitational(self) -> tuple[str, ...]:
        """Names of the parameters in which ``h`` is linear; none in a horizontal plane."""

    @abstractmethod
    def x_r(self, q: Vector) -> Vector:
        """Tip position [m], shape (2,), from the joint angles [rad]."""

    @abstractmethod
    def M(self, q: Vector) -> Matrix:
        """Inertia matrix of (1) [kg m^2], 2 x 2."""

    @abstractmethod
    def h(self, q: Vector) -> Vector:
        """Conservative torques of (1) [N m], shape (2,)."""

    @abstractmethod
    def friction(self, q_dot: Vector) -> Vector:
        """Friction torques at the joints [N m], shape (2,), against the motion."""

    @abstractmethod
    def inverse(self, x_r: Vector, elbow: Elbow) -> Vector:
        """Joint angles [rad] that bring the tip to ``x_r`` [m]."""

    def with_inertia(self, values: Vector) -> Arm:
        """Return the same arm with other `inertial` and `gravitational` parameters."""
        names = self.inertial + self.gravitational
        return rebind(self, **{name: values[i] for i, name in enumerate(names)})

    def J(self, q: Vector) -> Matrix:
        """Jacobian of (2) [m], 2 x 2: the derivative of `x_r`."""
        return jacobian(self.x_r, q)

    def J_dot(self, q: Vector, q_dot: Vector) -> Matrix:
        """Rate of the Jacobian [m/s], 2 x 2."""
        return time_derivative(self.J, [q], [q_dot], constants=self)

    def C(self, q: Vector, q_dot: Vector) -> Matrix:
        """Coriolis matrix of (1) [kg m^2/s], 2 x 2, in Christoffel form."""
        return christoffel(self.M, q, q_dot)

    def M_bar(self, q: Vector) -> Matrix:
        """Task-space inertia of (5), ``J^-T M J^-1`` [kg], 2 x 2."""
        J_inv = inverse(self.J(q))
        return J_inv.T @ self.M(q) @ J_inv

    def C_bar(self, q: Vector, q_dot: Vector) -> Matrix:
        """Task-space Coriolis matrix of (5), ``J^-T (C - M J^-1 J_dot) J^-1`` [kg/s], 2 x 2."""
        J_inv = inverse(self.J(q))
        curvature = self.M(q) @ J_inv @ self.J_dot(q, q_dot)
        return J_inv.T @ (self.C(q, q_dot) - curvature) @ J_inv

    def h_bar(self, q: Vector) -> Vector:
        """Task-space conservative forces of (5), ``J^-T h`` [N], shape (2,)."""
        return inverse(self.J(q)).T @ self.h(q)

    def acceleration(self, q: Vector, q_dot: Vector, tau: Vector, tip_force: Vector) -> Vector:
        """Joint accelerations of (1), with the force of (5) on the tip [rad/s^2], shape (2,).

        ``tip_force`` [N] is what the arm exerts on its surroundings.
        """
        resisting = self.C(q, q_dot) @ q_dot + self.h(q) + self.friction(q_dot)
        return inverse(self.M(q)) @ (tau - resisting - self.J(q).T @ tip_force)


@parameters
class TwoLinkArm(Arm):
    """The paper's planar arm: base at the origin, q1 from the X1 axis, q2 the relative elbow angle.

    Its inertia is ``M = [[p1 + 2 p3 cos q2, p2 + p3 cos q2], [p2 + p3 cos q2, p2]]``. In a vertical
    plane (X2 upwards) ``g1 = (m1 l_c1 + m2 l1) g`` and ``g2 = m2 l_c2 g``.
    """

    inertial: ClassVar[tuple[str, ...]] = ("p1", "p2", "p3")

    l1: Annotated[Positive, Quantity("m", "length of the base link")]
    l2: Annotated[Positive, Quantity("m", "length of the second link")]
    p1: Annotated[Positive, Quantity("kg m^2", "inertia about the base, elbow at a right angle")]
    p2: Annotated[Positive, Quantity("kg m^2", "inertia of the second link about the elbow")]
    p3: Annotated[float, Quantity("kg m^2", "inertia that couples the links")]
    plane: Annotated[Literal["horizontal", "vertical"], Quantity("", "plane of motion")] = (
        "horizontal"
    )
    g1: Annotated[NonNegative, Quantity("N m", "gravity torque of link 1, vertical plane")] = 0.0
    g2: Annotated[NonNegative, Quantity("N m", "gravity torque of link 2, vertical plane")] = 0.0
    viscous: Annotated[NonNegativePair, Quantity("N m s", "viscous friction of the joints")] = (
        0.0,
        0.0,
    )
    coulomb: Annotated[NonNegativePair, Quantity("N m", "Coulomb friction of the joints")] = (
        0.0,
        0.0,
    )
    coulomb_speed: Annotated[
        Positive, Quantity("rad/s", "joint speed at which 76 % of the Coulomb friction is reached")
    ] = 1e-3

    def __post_init__(self) -> None:
        if (self.p1 - self.p2) * self.p2 <= self.p3**2:
            raise ValueError(
                f"p1 = {self.p1}, p2 = {self.p2}, p3 = {self.p3} give an inertia matrix that is "
                "not positive definite; needs (p1 - p2) p2 > p3^2"
            )
        if self.plane == "horizontal" and (self.g1 or self.g2):
            raise ValueError("g1 and g2 must be 0 in a horizontal plane; set plane = 'vertical'")

    @property
    def gravitational(self) -> tuple[str, ...]:
        """Names of the parameters in which ``h`` is linear; none in a horizontal plane."""
        return ("g1", "g2") if self.plane == "vertical" else ()

    def x_r(self, q: Vector) -> Vector:
        """Tip position [m], shape (2,), from the joint angles [rad]."""
        return vector(
            self.l1 * cos(q[0]) + self.l2 * cos(q[0] + q[1]),
            self.l1 * sin(q[0]) + self.l2 * sin(q[0] + q[1]),
        )

    def elbow(self, q: Vector) -> Vector:
        """Position of the elbow [m], shape (2,): where the tip would be without a second link."""
        return rebind(self, l2=0.0).x_r(q)

    def M(self, q: Vector) -> Matrix:
        """Inertia matrix of (1) [kg m^2], 2 x 2."""
        coupling = self.p3 * cos(q[1])
        return matrix([[self.p1 + 2 * coupling, self.p2 + coupling], [self.p2 + coupling, self.p2]])

    def h(self, q: Vector) -> Vector:
        """Conservative torques of (1) [N m], shape (2,): gravity, (0, 0) in a horizontal plane."""
        if self.plane == "horizontal":
            return vector(0.0, 0.0)
        second = self.g2 * cos(q[0] + q[1])
        return vector(self.g1 * cos(q[0]) + second, second)

    def friction(self, q_dot: Vector) -> Vector:
        """Friction torques [N m], shape (2,): viscous and smoothed Coulomb, against the motion."""
        sliding = tanh(q_dot / self.coulomb_speed)
        return as_vector(self.viscous) * q_dot + as_vector(self.coulomb) * sliding

    def inverse(self, x_r: Vector, elbow: Elbow) -> Vector:
        """Joint angles [rad], shape (2,), that bring the tip to ``x_r`` [m].

        Raises
        ------
        Unreachable
            If the position lies outside the workspace or on its border, where J is singular.
        """
        if elbow not in ("+", "-"):
            raise UnknownName("elbow", elbow, ("+", "-"))
        x1, x2 = (float(v) for v in x_r)
        reach = float(sqrt(x1**2 + x2**2))
        inner, outer = abs(self.l1 - self.l2), self.l1 + self.l2
        if not inner + 1e-9 < reach < outer - 1e-9:
            raise Unreachable(
                f"the tip position ({x1:g}, {x2:g}) m is {reach:g} m from the base; the arm "
                f"reaches between {inner:g} and {outer:g} m, borders excluded (J is singular there)"
            )
        cosine = (reach**2 - self.l1**2 - self.l2**2) / (2 * self.l1 * self.l2)
        q2 = arccos(cosine) * (1 if elbow == "+" else -1)
        q1 = arctan2(x2, x1) - arctan2(self.l2 * sin(q2), self.l1 + self.l2 * cos(q2))
        return vector(q1, q2)
