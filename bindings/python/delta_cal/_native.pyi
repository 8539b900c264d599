from collections.abc import Sequence
from typing import Any, Final, final

from numpy.typing import NDArray

from ._types import Array, File, Vector

__all__ = [
    "__version__",
    "Report",
    "Robot",
    "Samples",
    "calibrate",
    "compare",
    "export",
    "import_",
    "plan",
    "samples_of_columns",
    "simulate",
    "validate",
    "workspace",
]

__version__: Final[str]

@final
class Robot:
    @staticmethod
    def of_bytes(name: str, bytes: bytes) -> Robot: ...
    @staticmethod
    def of_json(name: str, json: str, arguments: str) -> Robot: ...
    def counted_as(self, other: Robot) -> Robot: ...
    def with_arms(self, parameters: Any, transmissions: Any) -> Robot: ...
    def text(self) -> tuple[str, str]: ...
    def json(self) -> str: ...
    def forward(self, q: NDArray[Any], target: Any, strict: bool) -> Array: ...
    def inverse(self, x: NDArray[Any], target: Any, strict: bool) -> Array: ...
    def jacobian(self, q: NDArray[Any], strict: bool) -> Array: ...
    def parameter_jacobian(self, q: NDArray[Any], transmissions: bool, rods_at: Vector | None, strict: bool) -> Array: ...
    def columns(self, argument: str, names: Sequence[str]) -> list[tuple[str, float]]: ...
    def parameters(self) -> Array: ...
    def transmissions(self) -> Array: ...
    def name(self) -> str: ...
    def stated(self) -> dict[str, Any]: ...
    def fingerprint(self) -> str: ...

@final
class Samples:
    @staticmethod
    def of_bytes(parts: Sequence[File], columns: str | None) -> Samples: ...
    def arrays(self, robot: Robot) -> dict[str, NDArray[Any]]: ...
    def text(self) -> tuple[str, str]: ...
    def fingerprint(self) -> str: ...

@final
class Report:
    def text(self) -> str: ...
    def in_arrays(self) -> bool: ...
    def json(self) -> str: ...
    def html(self) -> str: ...

def samples_of_columns(
    robot: Robot, name: str, columns: Sequence[tuple[str, Any]], shapes: Array | None
) -> Samples: ...
def calibrate(
    begin: tuple[Robot, Samples] | tuple[File, Sequence[File], str],
    frame: str,
    method: str | None,
    robust: bool,
    limit: float | None,
    progress: Any,
) -> dict[str, Any]: ...
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
    x: Array | None,
    home: Sequence[float] | None,
    height: float | None,
    limit: float | None,
) -> dict[str, Any]: ...
def import_(file: File, firmware: str | None, stated: str) -> dict[str, Any]: ...
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
