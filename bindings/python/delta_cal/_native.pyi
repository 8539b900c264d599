from collections.abc import Sequence
from typing import Any, Final, Literal, final

from numpy.typing import ArrayLike, NDArray

from ._types import Array, Noise, PathLike, Rows, Section, Tolerance, Vector

__all__ = [
    "__version__",
    "Report",
    "Robot",
    "Samples",
    "calibrate",
    "calibrate_printer",
    "compare",
    "export",
    "import_",
    "plan",
    "read_samples",
    "robot_of_text",
    "samples_of_bytes",
    "samples_of_columns",
    "simulate",
    "validate",
    "workspace",
]

__version__: Final[str]

@final
class Robot:
    @staticmethod
    def nominal(
        *,
        base_radius: float,
        platform_radius: float,
        upper_arm: float,
        forearm: float,
        limits: ArrayLike,
        tolerance: Tolerance | None = None,
        zero: float | None = None,
        noise: Noise | None = None,
        **sections: Section,
    ) -> Robot: ...
    @staticmethod
    def from_parameters(
        parameters: ArrayLike,
        *,
        limits: ArrayLike,
        transmissions: ArrayLike | None = None,
        drive: Literal["rotary", "linear"] = "rotary",
        tolerance: Tolerance | None = None,
        zero: float | None = None,
        noise: Noise | None = None,
        **sections: Section,
    ) -> Robot: ...
    @staticmethod
    def read(path: PathLike) -> Robot: ...
    @staticmethod
    def from_toml(text: str, *, name: str = "robot") -> Robot: ...
    def write(self, path: PathLike) -> None: ...
    def to_toml(self) -> str: ...
    def to_dict(self) -> dict[str, Any]: ...
    def replace(
        self,
        *,
        parameters: ArrayLike | None = None,
        limits: ArrayLike | None = None,
        transmissions: ArrayLike | None = None,
        tolerance: Tolerance | None = None,
        zero: float | None = None,
        noise: Noise | None = None,
        **sections: Section | None,
    ) -> Robot: ...
    def forward(
        self, q: Rows, *, target: str | Vector | None = None, errors: Literal["nan", "raise"] = "nan"
    ) -> Array: ...
    def inverse(
        self, x: Rows, *, target: str | Vector | None = None, errors: Literal["nan", "raise"] = "nan"
    ) -> Array: ...
    def jacobian(self, q: Rows, *, errors: Literal["nan", "raise"] = "nan") -> Array: ...
    def parameter_jacobian(
        self, q: Rows, *, transmissions: bool = False, errors: Literal["nan", "raise"] = "nan"
    ) -> Array: ...
    def _vectors(self, argument: str, given: Rows) -> Array: ...
    def _rods_jacobian(self, q: Rows, point: Vector) -> Array: ...
    @property
    def parameters(self) -> Array: ...
    @property
    def transmissions(self) -> Array: ...
    @property
    def limits(self) -> tuple[float, float]: ...
    @property
    def tolerance(self) -> tuple[float, float] | None: ...
    @property
    def zero(self) -> float | None: ...
    @property
    def noise(self) -> tuple[float | tuple[float, float, float], float] | None: ...
    @property
    def name(self) -> str: ...
    @property
    def drive(self) -> Literal["rotary", "linear"]: ...
    @property
    def fingerprint(self) -> str: ...
    def _repr_html_(self) -> str: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Samples:
    def arrays(self, robot: Robot) -> dict[str, NDArray[Any]]: ...
    @property
    def name(self) -> str: ...
    @property
    def text(self) -> str: ...
    @property
    def fingerprint(self) -> str: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Report:
    def text(self) -> str: ...
    def json(self) -> str: ...
    def html(self) -> str: ...

def robot_of_text(name: str, text: str) -> Robot: ...
def samples_of_bytes(
    parts: Sequence[tuple[str, bytes]], columns: str | None
) -> Samples: ...
def samples_of_columns(
    robot: Robot, name: str, columns: Sequence[tuple[str, Any]], shapes: Array | None
) -> Samples: ...
def calibrate(
    robot: Robot,
    samples: Samples,
    frame: str,
    method: str | None,
    robust: bool,
    limit: float | None,
    progress: Any,
) -> dict[str, Any]: ...
def calibrate_printer(
    path: PathLike,
    samples: Sequence[PathLike],
    stated: dict[str, Any],
    method: str | None,
    robust: bool,
    limit: float | None,
    progress: Any,
) -> dict[str, Any]: ...
def read_samples(
    path: PathLike, positions: PathLike | None = None, *, columns: str | None = None
) -> Samples: ...
def plan(
    robot: Robot,
    count: int,
    samples: Samples | None,
    measure: str | None,
    frame: str,
    within: str | None,
    absolute: bool,
    order: str,
    accuracy: float | None,
    seed: int,
    names: str | None,
    progress: Any,
) -> dict[str, Any]: ...
def validate(robot: Robot, samples: Samples, limit: float, frame: str) -> dict[str, Any]: ...
def export(
    robot: Robot,
    target: str,
    nominal: Robot | None,
    x: Rows | None,
    home: Sequence[float] | None,
    height: float | None,
    limit: float | None,
) -> dict[str, Any]: ...
def import_(path: PathLike, firmware: str | None, stated: dict[str, Any]) -> dict[str, Any]: ...
def simulate(
    robot: Robot,
    first: int,
    count: int,
    seed: int,
    poses: int,
    method: str,
    planned: bool,
    spread: str,
    progress: Any,
) -> str: ...
def workspace(robot: Robot, tolerance: float, spacing: float | None) -> dict[str, Any]: ...
def compare(before: Robot, after: Robot) -> dict[str, Any]: ...
