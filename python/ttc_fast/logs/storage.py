"""Places that are no disk: URLs of fsspec, such as s3://fleet/drive.mcap, of the extra ``fleet``.

A log at a URL is fetched, a piece at a time, to a scratch folder of this process, and its copy goes when it is no
longer read. ``TTC_FAST_SCRATCH`` names another folder than that of the system, and ``TTC_FAST_SCRATCH_GB`` the most
that one log may take there. A process that is killed cannot clear up: whichever process fetches next removes what
belongs to none that lives, by a lock that ends with its process.

Object stores refuse a request now and then (503 and the like). Each access is tried again with growing pauses, and
then ends in a ``StorageError``, which says that a later run may succeed.
"""

from __future__ import annotations

import os
import shutil
import tempfile
import time
import weakref
from contextlib import contextmanager, suppress
from glob import glob
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any, TypeVar

from ttc_fast._extras import install
from ttc_fast.logs.log import ORIGINS, LogError
from ttc_fast.logs.stamps import LISTS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from os import PathLike

Location = Path | str
"""A path of this machine, or a URL as a str."""
T = TypeVar("T")
PAUSES = (0.5, 1.0, 2.0, 4.0)
"""s before an access is tried again."""
PREFIX = "ttc-fast-scratch-"
OBJECT_STORES = frozenset({"s3", "s3a", "gs", "gcs", "abfs", "abfss", "az", "adl", "oci", "oss", "memory"})
"""Protocols of stores in which an object appears whole, when all of it has come."""


class StorageError(LogError):
    """A place did not give or take what it was asked for, though it was asked several times: it may do so later."""


def located(path: str | PathLike[str]) -> Location:
    """Return a URL as it is, and anything else as a path; file:// is a path.

    Examples
    --------
    >>> from ttc_fast.logs.storage import located
    >>> located("s3://fleet/drive.mcap"), str(located("file:///tmp/drive.bag")), str(located("drive.bag"))
    ('s3://fleet/drive.mcap', '/tmp/drive.bag', 'drive.bag')
    """
    text = os.fspath(path)
    if text.startswith("file://"):
        return Path(text[len("file://") :])
    return text if "://" in text else Path(text)


def is_url(path: str | PathLike[str]) -> bool:
    """Whether a path is a URL."""
    return isinstance(located(path), str)


def name_in(place: Location) -> str:
    """Return the last part of a place."""
    return PurePosixPath(place.rstrip("/")).name if isinstance(place, str) else place.resolve().name


def join(folder: Location, *names: str) -> Location:
    """Return a place in a folder."""
    return "/".join((folder.rstrip("/"), *names)) if isinstance(folder, str) else folder.joinpath(*names)


def absolute(place: Location) -> Location:
    """Return the name of a place that holds in whichever folder a process is."""
    return place if isinstance(place, str) else Path(os.path.abspath(place))


def found(paths: str | PathLike[str] | Iterable[str | PathLike[str]]) -> list[Location]:
    """Return places, with what matches instead of one that has ``*``, ``?`` or ``[`` and is not there itself.

    Raises
    ------
    LogError
        If nothing matches, or a name is not UTF-8.
    """
    places: list[Location] = []
    for path in [paths] if isinstance(paths, (str, os.PathLike)) else paths:
        place = located(path)
        if not any(sign in str(place) for sign in "*?[") or (isinstance(place, Path) and place.exists()):
            places.append(place)
            continue
        matches: list[Location]
        if isinstance(place, Path):
            matches = [Path(match) for match in sorted(glob(str(place), recursive=True))]
        else:
            scheme = place.partition("://")[0] + "://"
            names = _asked(place, lambda fs, name: sorted(fs.glob(name)))
            matches = [scheme + (match.partition("://")[2] or match) for match in names]
        if not matches:
            raise LogError(place, "nothing matches it")
        places += matches
    for place in places:
        try:
            str(place).encode()
        except UnicodeEncodeError:  # rows, tables and pictures could not name it
            raise LogError(place, "has a name that is not UTF-8; rename it") from None
    return places


def size_and_time(place: Location) -> tuple[int, float]:
    """Return the bytes of a file or of all files of a folder, and when the newest of them was changed, s since 1970.

    Raises
    ------
    FileNotFoundError
        If there is nothing.
    StorageError
        If a URL does not answer.
    """
    if isinstance(place, str):
        return _asked(place, _size_and_time)
    lists = (place.parent / name for name in LISTS)
    folder = [*place.iterdir(), *(each for each in lists if each.is_file())] if place.is_dir() else [place]
    stats = [each.stat() for each in folder if not each.is_dir()]
    return sum(each.st_size for each in stats), max((each.st_mtime for each in stats), default=0.0)


def _size_and_time(fs: Any, name: str) -> tuple[int, float]:
    infos = [fs.info(each) for each in _files(fs, name)]
    return sum(int(each.get("size") or 0) for each in infos), max((_changed(each) for each in infos), default=0.0)


def _changed(info: dict[str, Any]) -> float:
    """Return when a file was changed by what its file system says of it; 0 if it does not say."""
    for key in ("LastModified", "mtime", "modified", "last_modified", "updated", "created"):
        value = info.get(key)
        if value is not None:
            return float(value.timestamp() if hasattr(value, "timestamp") else value)
    return 0.0


def _files(fs: Any, name: str) -> list[str]:
    """Return the file of that name, or the files of that folder and the lists of stamps beside it."""
    if not fs.isdir(name):
        return [name]
    above = name.rstrip("/").rpartition("/")[0]
    lists = [f"{above}/{each}" for each in LISTS]
    inside = [each["name"] for each in fs.ls(name, detail=True) if each["type"] == "file"]
    return [*inside, *(each for each in lists if fs.exists(each))]


# Fetching


class Copy:
    """A copy of what is at a URL, on the disk of this machine.

    Attributes
    ----------
    path : Path
        The file or folder, with the name that it has at the URL.
    """

    def __init__(self, url: str) -> None:
        self._folder = Path(tempfile.mkdtemp(dir=_scratch_of_this_process()))
        self.path = self._folder / "above" / name_in(url)
        ORIGINS[str(self.path)] = url
        try:
            _asked(url, self._fetch)
        except FileNotFoundError:
            self.remove()
            raise LogError(url, "cannot be opened: no such file or folder") from None
        except BaseException:
            self.remove()
            raise

    def _fetch(self, fs: Any, name: str) -> None:
        shutil.rmtree(self.path.parent, ignore_errors=True)
        files = _files(fs, name)
        folder = files != [name]
        sizes = {each: int(fs.info(each).get("size") or 0) for each in files}
        _check_room(self.path, sum(sizes.values()), self._folder)
        (self.path if folder else self.path.parent).mkdir(parents=True)
        for each, size in sizes.items():
            beside = folder and each.rpartition("/")[0].rstrip("/") != name.rstrip("/")
            target = self.path
            if folder:
                target = (self.path.parent if beside else self.path) / each.rpartition("/")[2]
            fs.get_file(each, str(target))
            came = target.stat().st_size
            if size and came != size:
                raise OSError(f"{came} of {size} bytes came")

    def remove(self) -> None:
        """Remove the copy."""
        ORIGINS.pop(str(self.path), None)
        shutil.rmtree(self._folder, ignore_errors=True)


def _check_room(path: Path, size: int, folder: Path) -> None:
    """Raise if a log takes more than it may, or than there is."""
    most = float(os.environ.get("TTC_FAST_SCRATCH_GB", "inf"))
    free = shutil.disk_usage(folder).free
    if size > most * 1e9:
        raise LogError(path, f"has {size / 1e9:.3g} GB, and TTC_FAST_SCRATCH_GB allows {most:g}")
    if size > free:
        how = "make room there, or let TTC_FAST_SCRATCH name a larger one"
        raise LogError(
            path, f"has {size / 1e9:.3g} GB, and the scratch folder {folder.parent} has {free / 1e9:.3g}: {how}"
        )


_OF_PROCESS: dict[int, tuple[Path, Any]] = {}
"""The scratch folder of this process, with the lock that says that it lives."""


def _scratch_of_this_process() -> Path:
    process = os.getpid()
    if process not in _OF_PROCESS:
        parent = Path(os.environ.get("TTC_FAST_SCRATCH") or tempfile.gettempdir())
        parent.mkdir(parents=True, exist_ok=True)
        _sweep(parent)
        folder = Path(tempfile.mkdtemp(prefix=PREFIX, dir=parent))
        lock = folder.with_name(f"{folder.name}.lock").open("w")
        _try_lock(lock)
        _OF_PROCESS[process] = folder, lock
        weakref.finalize(_ALIVE, _clear, folder, lock, process)
    return _OF_PROCESS[process][0]


class _Process:
    """Lives as long as the process does."""


_ALIVE = _Process()


def _clear(folder: Path, lock: Any, process: int) -> None:
    if os.getpid() == process:  # and not that of a fork
        shutil.rmtree(folder, ignore_errors=True)
        Path(lock.name).unlink(missing_ok=True)
        lock.close()


def _try_lock(file: Any) -> bool:
    """Lock a file until this process ends; return False if another process has it, or there are no locks here."""
    try:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (ImportError, OSError):
        return False
    return True


def _sweep(parent: Path) -> None:
    """Remove the scratch folders of processes that are gone."""
    for lock in parent.glob(f"{PREFIX}*.lock"):
        with suppress(OSError), lock.open("r+") as file:
            young = time.time() - lock.stat().st_mtime < 1.0  # its process may be about to lock it
            if not young and _try_lock(file):
                shutil.rmtree(lock.with_suffix(""), ignore_errors=True)
                lock.unlink(missing_ok=True)


# Writing and reading small things


@contextmanager
def written_whole(place: Location, temporary: Location) -> Iterator[Path]:
    """Yield a path to write to; what it holds then is at the place, whole. After an error nothing is there.

    Parameters
    ----------
    place : Location
        Where it goes.
    temporary : Location
        A folder on the same file system, where it is under another name meanwhile. Object stores do without it.
    """
    if isinstance(place, Path):
        temporary = Path(temporary)
        temporary.mkdir(parents=True, exist_ok=True)
        descriptor, name = tempfile.mkstemp(suffix=place.suffix, dir=temporary)
        os.close(descriptor)
        try:
            yield Path(name)
            with open(name, "rb") as file:
                os.fsync(file.fileno())
            Path(name).chmod(0o666 & ~_umask())
            os.replace(name, place)
        finally:
            Path(name).unlink(missing_ok=True)
        return
    folder = Path(tempfile.mkdtemp(dir=_scratch_of_this_process()))
    try:
        local = folder / name_in(place)
        yield local
        _asked(place, lambda fs, name: _put(fs, local, name, str(temporary)))
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _umask() -> int:
    mask = os.umask(0o022)
    os.umask(mask)
    return mask


def _put(fs: Any, local: Path, name: str, temporary: str) -> None:
    protocols = {fs.protocol} if isinstance(fs.protocol, str) else set(fs.protocol)
    if protocols & OBJECT_STORES:
        fs.put_file(str(local), name)
        return
    aside = f"{fs._strip_protocol(temporary)}/{local.parent.name}-{local.name}"
    fs.makedirs(aside.rpartition("/")[0], exist_ok=True)
    fs.makedirs(name.rpartition("/")[0], exist_ok=True)
    fs.put_file(str(local), aside)
    fs.mv(aside, name)


def read_by(place: Location, read: Callable[[Any], T]) -> T:
    """Open a file to read bytes, and return what ``read`` makes of it.

    Raises
    ------
    FileNotFoundError
        If it is not there.
    """
    if isinstance(place, Path):
        with place.open("rb") as file:
            return read(file)

    def by(fs: Any, name: str) -> T:
        with fs.open(name, "rb") as file:
            return read(file)

    return _asked(place, by)


def remove(place: Location) -> None:
    """Remove a file or a folder, if it is there."""
    if isinstance(place, Path):
        if place.is_dir():
            shutil.rmtree(place, ignore_errors=True)
        else:
            place.unlink(missing_ok=True)
        return
    with suppress(FileNotFoundError):
        _asked(place, lambda fs, name: fs.rm(name, recursive=True))


def _asked(url: str, ask: Callable[[Any, str], T]) -> T:
    """Return what ``ask`` gets from the file system of a URL; try again where that may help."""
    try:
        import fsspec
    except ModuleNotFoundError:
        raise LogError(url, f"needs fsspec, which is not installed: {install('fleet')}") from None
    try:
        fs, name = fsspec.core.url_to_fs(url)
    except ImportError as error:
        raise LogError(url, f"needs a package that is not installed: {error}") from None
    except ValueError as error:
        raise LogError(url, f"is no URL that fsspec knows: {error}") from None
    for pause in (*PAUSES, None):
        try:
            fs.invalidate_cache()
            return ask(fs, name)
        except (FileNotFoundError, LogError):
            raise
        except PermissionError as error:
            raise LogError(url, f"may not be accessed: {error}") from error
        except Exception as error:  # each file system has errors of its own
            if pause is None:
                said = str(error) or type(error).__name__
                raise StorageError(url, f"does not answer as it should, {len(PAUSES) + 1} times: {said}") from error
            time.sleep(pause)
    raise AssertionError
