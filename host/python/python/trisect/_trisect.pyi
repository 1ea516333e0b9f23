import os
import typing as t

import numpy as np
import numpy.typing as npt

from . import parts

__version__: str

_Path = t.Union[str, "os.PathLike[str]"]
_Floats = npt.NDArray[np.float32]
_Image = t.Union["Frame", _Floats, _Path]
_Backend = t.Literal["auto", "cpu", "wgpu", "cuda"]
_Aov = t.Literal[
    "normal", "shading-normal", "geometric-normal", "position", "albedo", "depth", "id", "variance",
    "samples", "uv", "cryptomatte",
]

class _Communicator(t.Protocol):
    """A communicator of mpi4py."""

    def Dup(self) -> t.Any: ...
    def Get_rank(self) -> int: ...
    def Get_size(self) -> int: ...

@t.final
class Progress:
    @property
    def done(self) -> int: ...
    @property
    def total(self) -> t.Optional[int]: ...
    @property
    def seconds(self) -> float: ...
    @property
    def left(self) -> t.Optional[float]: ...
    @property
    def error(self) -> t.Optional[float]: ...

@t.final
class LabProgress:
    @property
    def done(self) -> int: ...
    @property
    def total(self) -> int: ...
    @property
    def stage(self) -> str: ...
    @property
    def seconds(self) -> float: ...
    @property
    def left(self) -> float: ...
    @property
    def message(self) -> t.Optional[str]: ...

@t.final
class Scene:
    def __new__(
        cls,
        *,
        camera: parts.Camera,
        materials: t.Mapping[str, parts.Material],
        objects: t.Sequence[parts.Object] = (),
        lights: t.Sequence[parts.Light] = (),
        sky: t.Optional[parts.Sky] = None,
        textures: t.Optional[t.Mapping[str, t.Union[parts.Texture, parts.Texels, parts.Pixels]]] = None,
        media: t.Optional[t.Mapping[str, parts.Medium]] = None,
        atmosphere: t.Optional[str] = None,
        portals: t.Sequence[parts.Portal] = (),
        ground: t.Optional[parts.Ground] = None,
        width: int = 640,
        height: int = 360,
        spp: int = 64,
        depth: int = 50,
        about: str = "",
    ) -> Scene: ...
    @staticmethod
    def load(
        path: _Path,
        *,
        set: t.Optional[t.Dict[str, t.Any]] = None,
        camera: t.Union[None, str, int] = None,
        time: t.Optional[float] = None,
        allow_outside: bool = False,
    ) -> Scene: ...
    @staticmethod
    def parse(text: str, name: str = "<text>") -> Scene: ...
    @staticmethod
    def hello_world() -> Scene: ...
    @staticmethod
    def from_bytes(bytes: bytes) -> Scene: ...
    def to_bytes(self) -> bytes: ...
    def edit(self, changes: t.Dict[str, t.Any]) -> Scene: ...
    @property
    def name(self) -> str: ...
    @property
    def warnings(self) -> t.List[str]: ...
    @property
    def objects(self) -> t.List[str]: ...
    @property
    def primitives(self) -> int: ...
    @property
    def size(self) -> t.Tuple[int, int]: ...
    @property
    def spp(self) -> int: ...
    @property
    def digest(self) -> str: ...

@t.final
class Film:
    @property
    def mean(self) -> _Floats: ...
    @property
    def variance(self) -> _Floats: ...
    @property
    def samples(self) -> npt.NDArray[np.uint32]: ...
    @property
    def rejected(self) -> int: ...
    @property
    def width(self) -> int: ...
    @property
    def height(self) -> int: ...
    def save(self, path: _Path) -> None: ...
    @staticmethod
    def load(path: _Path) -> Film: ...
    def __add__(self, other: Film, /) -> Film: ...

@t.final
class Frame:
    @property
    def image(self) -> _Floats: ...
    @property
    def film(self) -> Film: ...
    @property
    def aovs(self) -> t.Dict[str, npt.NDArray[t.Any]]: ...
    @property
    def alpha(self) -> t.Optional[_Floats]: ...
    @property
    def stats(self) -> t.Dict[str, t.Any]: ...
    @property
    def complete(self) -> bool: ...
    def save(
        self,
        path: _Path,
        *,
        exposure: t.Union[None, float, t.Literal["auto"]] = None,
        tonemap: t.Optional[t.Literal["none", "filmic", "agx", "aces"]] = None,
        gamma: t.Optional[float] = None,
        bits: t.Literal[8, 16] = 8,
        full: bool = False,
    ) -> None: ...
    def _repr_png_(self) -> bytes: ...

@t.final
class Renderer:
    def __new__(
        cls,
        scene: Scene,
        backend: t.Optional[_Backend] = None,
        *,
        device: t.Optional[int] = None,
        threads: t.Optional[int] = None,
    ) -> Renderer: ...
    @t.overload
    def render(
        self,
        spp: t.Optional[int] = None,
        *,
        budget: t.Union[None, str, float] = None,
        target_error: t.Union[None, str, float] = None,
        max_spp: t.Optional[int] = None,
        adaptive: t.Literal["auto", "on", "off"] = "auto",
        width: t.Optional[int] = None,
        height: t.Optional[int] = None,
        crop: t.Optional[t.Tuple[float, float, float, float]] = None,
        depth: t.Optional[int] = None,
        seed: int = 0,
        sampler: t.Optional[t.Literal["sobol", "independent"]] = None,
        roulette: t.Optional[bool] = None,
        roulette_depth: t.Optional[int] = None,
        light_sampling: bool = True,
        clamp: t.Optional[float] = None,
        transparent: bool = False,
        denoise: t.Optional[t.Literal["off", "atrous", "svgf", "oidn"]] = None,
        aov: t.Union[_Aov, t.Sequence[_Aov]] = (),
        progress: t.Union[None, bool, t.Callable[[Progress], t.Any]] = None,
        sample_range: t.Optional[t.Tuple[int, int]] = None,
        checkpoint: t.Optional[_Path] = None,
        checkpoint_every: t.Union[str, float] = "30s",
        resume: bool = False,
        comm: None = None,
    ) -> Frame: ...
    @t.overload
    def render(
        self,
        spp: t.Optional[int] = None,
        *,
        width: t.Optional[int] = None,
        height: t.Optional[int] = None,
        crop: t.Optional[t.Tuple[float, float, float, float]] = None,
        depth: t.Optional[int] = None,
        seed: int = 0,
        sampler: t.Optional[t.Literal["sobol", "independent"]] = None,
        roulette: t.Optional[bool] = None,
        roulette_depth: t.Optional[int] = None,
        light_sampling: bool = True,
        clamp: t.Optional[float] = None,
        transparent: bool = False,
        denoise: t.Optional[t.Literal["off", "atrous", "svgf", "oidn"]] = None,
        aov: t.Union[_Aov, t.Sequence[_Aov]] = (),
        progress: t.Union[None, bool, t.Callable[[Progress], t.Any]] = None,
        sample_range: t.Optional[t.Tuple[int, int]] = None,
        comm: _Communicator,
    ) -> t.Optional[Frame]: ...
    def update(self, scene: Scene) -> t.Dict[str, t.Any]: ...
    def cancel(self) -> None: ...
    @property
    def scene(self) -> Scene: ...
    @property
    def backend(self) -> str: ...
    @property
    def device(self) -> str: ...

@t.final
class Tradeoff:
    @property
    def report(self) -> t.Dict[str, t.Any]: ...
    @property
    def table(self) -> t.List[t.Dict[str, t.Any]]: ...
    @property
    def reference(self) -> t.Optional[t.Dict[str, t.Any]]: ...
    @property
    def advice(self) -> str: ...
    @property
    def complete(self) -> bool: ...
    def plot(self, ax: t.Any = None) -> t.Any: ...
    def save(self, path: _Path) -> None: ...
    def _repr_html_(self) -> str: ...

@t.final
class Convergence:
    @property
    def report(self) -> t.Dict[str, t.Any]: ...
    @property
    def table(self) -> t.List[t.Dict[str, t.Any]]: ...
    @property
    def reference(self) -> t.Optional[t.Dict[str, t.Any]]: ...
    @property
    def complete(self) -> bool: ...
    def plot(self, ax: t.Any = None) -> t.Any: ...
    def save(self, path: _Path) -> None: ...
    def _repr_html_(self) -> str: ...

def devices() -> t.List[t.Dict[str, t.Any]]: ...
def merge(films: t.Iterable[t.Union[Film, _Path]]) -> Film: ...
def read_image(path: _Path) -> _Floats: ...
def evaluate(
    images: t.Union[t.Sequence[_Image], t.Dict[str, t.Sequence[_Image]]],
    reference: t.Union[_Image, t.Sequence[_Image]],
    *,
    seconds: t.Union[None, t.Sequence[float], t.Dict[str, t.Sequence[float]]] = None,
    frames: bool = False,
) -> t.Dict[str, t.Any]: ...
def compare(image: _Image, reference: _Image, *, flip_map: bool = False) -> t.Dict[str, t.Any]: ...
def tradeoff(
    scene: Scene,
    *,
    knobs: t.Union[None, str, t.Sequence[str]] = None,
    spp: t.Union[None, int, t.Sequence[int]] = None,
    max_spp: t.Optional[int] = None,
    against: t.Optional[_Path] = None,
    seeds: int = 8,
    time_limit: t.Union[None, str, float] = "8m",
    reference_spp: t.Optional[int] = None,
    cache: t.Optional[_Path] = None,
    backend: t.Optional[_Backend] = "auto",
    device: t.Optional[int] = None,
    threads: t.Optional[int] = None,
    width: t.Optional[int] = None,
    height: t.Optional[int] = None,
    depth: t.Optional[int] = None,
    sampler: t.Optional[t.Literal["sobol", "independent"]] = None,
    roulette: t.Optional[bool] = None,
    roulette_depth: t.Optional[int] = None,
    light_sampling: bool = True,
    clamp: t.Optional[float] = None,
    progress: t.Union[None, bool, t.Callable[[LabProgress], t.Any]] = None,
) -> Tradeoff: ...
def converge(
    scene: Scene,
    *,
    knobs: t.Union[None, str, t.Sequence[str]] = None,
    first: int = 16,
    last: int = 4096,
    seeds: int = 8,
    time_limit: t.Union[None, str, float] = "8m",
    reference_spp: t.Optional[int] = None,
    cache: t.Optional[_Path] = None,
    backend: t.Optional[_Backend] = "auto",
    device: t.Optional[int] = None,
    threads: t.Optional[int] = None,
    width: t.Optional[int] = None,
    height: t.Optional[int] = None,
    depth: t.Optional[int] = None,
    sampler: t.Optional[t.Literal["sobol", "independent"]] = None,
    roulette: t.Optional[bool] = None,
    roulette_depth: t.Optional[int] = None,
    light_sampling: bool = True,
    clamp: t.Optional[float] = None,
    progress: t.Union[None, bool, t.Callable[[LabProgress], t.Any]] = None,
) -> Convergence: ...
