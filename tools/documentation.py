"""The pages of the documentation site that docs/ does not hold, made when MkDocs builds it (a hook of mkdocs.yml).

Home, contributing and changes are the files of the repository's root. The reference is made of the package itself: the
names that it exports, whose docstrings mkdocstrings renders; its statuses, settings and commands. A public name that
``PAGES`` misses ends the build.
"""

from __future__ import annotations

import importlib
import inspect
import json
import re
import textwrap
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ttc_fast import _settings
from ttc_fast._settings import REQUIRED, settings_of
from ttc_fast.brake import BrakeSettings
from ttc_fast.cli import parsers
from ttc_fast.configuration import CRITERIA
from ttc_fast.logs import LogOptions
from ttc_fast.ros.dds.settings import DdsSettings
from ttc_fast.ros.settings import NodeSettings

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterable

    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files

    from ttc_fast._settings import Setting

ROOT = Path(__file__).parents[1]
FROM_ROOT = {"README.md": "index.md", "CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changes.md"}
PAGES = {
    "scans": (
        "Laser scans",
        "ScanTTC ScanSweptPath SweptPath ittc RangeRate KthSmallest NeighbourSupport Nearest NearestBatch NearestPoint "
        "NearestPointBatch RangeRateNearest Counts CountsBatch NoDataError SIMD_LEVEL __version__",
    ),
    "clouds": (
        "Point clouds",
        "CloudTracker Alignment robust_min_x ttc_from_clouds Gate Minimum Quantile MeanOfLowest InterquartileFence "
        "Supported Cluster fit_road Road RoadFit MinX CloudTTC from_pointcloud2",
    ),
    "distances": (
        "Distances",
        "DistanceTracker TrackedTTC MotionMixture KalmanCA KalmanCV SlidingLine SlidingParabola TheilSen AlphaBeta "
        "EstimatedNoise ttc_from_distances",
    ),
    "camera": (
        "Camera",
        "ttc_from_keypoints ttc_from_scale ttc_from_heights ScaleTracker Consensus MedianRatio TrimmedMeanRatio "
        "LeastSquares KeypointTTC",
    ),
    "formulae": (
        "Formulae",
        "ttc_constant_velocity ttc_constant_acceleration time_headway deceleration_to_avoid_crash stopping_distance "
        "rss_longitudinal_distance closing_speed_from_ego_velocity range_rate_from_target_velocity",
    ),
    "brake": (
        "Brake",
        "BrakeController Motion Estimate Decision IttcThreshold SweptPathThreshold StoppingDistance PresentArc "
        "RssDistance EstimateThreshold brake.BrakeSettings brake.Counters brake.Threat brake.Threats brake.Evaluation "
        "brake.Criterion brake.Needs configuration.Configuration configuration.ConfigurationError "
        "configuration.read_file",
    ),
    "logs": (
        "Logs and replay",
        "logs.open_log logs.ScanLog logs.CloudLog logs.DistanceLog logs.Log logs.ScanFrame logs.CloudFrame "
        "logs.DistanceFrame logs.Scanner logs.Lidar logs.LogOptions logs.LogError logs.forward_left_up logs.FORMATS "
        "replay.Replay replay.replay_many replay.Files replay.Replayed replay.Progress replay.Settings replay.Row "
        "replay.Summary replay.Event replay.sample replay.to_pandas",
    ),
    "training": (
        "Training and comparison",
        "gym.SafetyFilter gym.VectorSafetyFilter gym.Observed gym.f1tenth gym.unseen compat.f1tenth_gym "
        "compat.udacity_camera",
    ),
    "pictures": ("Pictures", "plot"),
    "statuses": ("Statuses", "Status Detection RoadStatus Command Reason brake.Source"),
}
"""The title of each page of the reference, and its names, as ``ttc_fast`` has them."""
EXPORTING = ("ttc_fast", "ttc_fast.brake", "ttc_fast.logs", "ttc_fast.replay")
STATUSES = """\
[What a TTC is for each status](../design.md#statuses) is one table. In arrays the values are
uint8, and a member equals its number: `array == ttc_fast.Status.CLOSING`.
"""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are made (called by MkDocs)."""
    from mkdocs.structure.files import File

    for name, text in made_pages().items():
        files.append(File.generated(config, name, content=text))
    return files


def made_pages() -> dict[str, str]:
    """Return the text of each page that is made, by its place in the site."""
    check_names()
    pages = {page: from_root(name) for name, page in FROM_ROOT.items()}
    for page, (title, names) in PAGES.items():
        said = STATUSES if page == "statuses" else ""
        pages[f"reference/{page}.md"] = f"# {title}\n\n{said}\n" + "\n".join(map(reference, names.split()))
    pages["reference/settings.md"] = settings_page()
    pages["reference/commands.md"] = commands_page(parsers())
    return pages


def from_root(name: str) -> str:
    """Return a file of the root, with its links as they are from within docs/."""
    text = (ROOT / name).read_text(encoding="utf-8")
    for other, page in FROM_ROOT.items():
        text = text.replace(f"]({other}", f"]({page}")
    hidden = "---\nhide: [navigation]\n---\n\n" if name == "README.md" else ""
    return hidden + text.replace("](docs/", "](")


def reference(name: str) -> str:
    """Return the heading of a name, how it is called, and what mkdocstrings replaces by its docstring."""
    full = f"ttc_fast.{name}"
    target = _object(full)
    shown = name.replace("_", "\\_")  # which is no emphasis
    heading = f"## {shown} {{ #{full} }}\n\n"
    if isinstance(target, type) and issubclass(target, Enum):
        return heading + _enumeration(target)
    members = list(getattr(target, "__all__", []))
    if isinstance(target, type):
        members = [each for each in vars(target) if _is_documented(target, each)]
    options = f"    options: {{members: {json.dumps(members or False)}}}\n"
    return f"{heading}{_signature(name, target)}::: {full}\n{options}"


def _is_documented(owner: Any, name: str) -> bool:
    """Whether a class has a docstring for a member beside its own: not for the fields of a named tuple."""
    member = inspect.getattr_static(owner, name)
    data = name in getattr(owner, "_fields", ()) or isinstance(member, type)
    called = callable(member) or isinstance(member, (classmethod, staticmethod, property))
    return not name.startswith("_") and not data and (called or inspect.isgetsetdescriptor(member))


def _enumeration(kind: type[Enum]) -> str:
    """Return what an enumeration means, and a table of its members, from the section Attributes of its docstring."""
    about, _, rest = (inspect.getdoc(kind) or "").partition("Attributes\n----------\n")
    meanings = dict(re.findall(r"^([A-Z_]+)\n((?:    .*\n?)+)", rest, flags=re.MULTILINE))
    rows = [f"| `{each.name}` | {each.value} | {' '.join(meanings[each.name].split())} |" for each in kind]
    return "\n".join([about, "| name | value | |", "|---|---|---|", *rows, ""])


def _signature(name: str, target: Any) -> str:
    """Return how a class or function is called; nothing for what no caller makes."""
    if not callable(target) or (isinstance(target, type) and issubclass(target, (Enum, Exception))):
        return ""
    try:
        signature = inspect.signature(target)
    except ValueError:
        return ""
    bare = [each.replace(annotation=each.empty) for each in signature.parameters.values()]
    call = f"{name}{signature.replace(parameters=bare, return_annotation=signature.empty)}"
    return f"```text\n{textwrap.fill(call, 92, subsequent_indent='    ', break_on_hyphens=False)}\n```\n\n"


def check_names() -> None:
    """Raise if the package exports a name that no page has."""
    listed = [f"ttc_fast.{name}" for _, names in PAGES.values() for name in names.split()]
    objects = [_object(name) for name in listed]
    for module in map(importlib.import_module, EXPORTING):
        for name in module.__all__:
            if not any(getattr(module, name) is each for each in objects):
                raise LookupError(f"tools/documentation.py: no page has {module.__name__}.{name}; put it into PAGES")


def _object(name: str) -> Any:
    module, _, last = name.rpartition(".")
    owner = importlib.import_module(module)
    return getattr(owner, last) if hasattr(owner, last) else importlib.import_module(name)


def settings_page() -> str:
    """Return the tables of all settings, from their descriptions."""
    parts = [
        "# Settings",
        "Arguments of a class have these names everywhere: in Python, in the parts of a "
        "[file](../replay.md#settings-from-a-file), as parameters of the [node](#ttc-fast-node), which has more, "
        "and, with dashes, as options of `ttc-fast replay`.",
        *_table("ScanTTC", "`[scan]` in a file.", _settings.SCAN),
        *_table("Gate", "`[gate]` in a file.", _settings.GATE),
        *_table("RangeRate", "`[range_rate]` in a file.", _settings.RANGE_RATE),
        *_table("BrakeController", "`[brake]` in a file.", settings_of(BrakeSettings)),
    ]
    for name, kind in CRITERIA.items():
        parts += _table(name, f'A criterion; `[[criteria]]` with `kind = "{name}"` in a file.', settings_of(kind))
    parts += _table("open_log", "Options of a log.", settings_of(LogOptions))
    node = (
        "[Parameters](../ros.md#parameters), at the top of a file. Those of BrakeController are parameters as well, "
        "but for `time_increment`, which each scan says. None is an empty list in a file."
    )
    parts += _table("ttc-fast node", node, settings_of(NodeSettings))
    parts += _table("ttc-fast node --dds", "`[dds]` in a file.", settings_of(DdsSettings))
    return "\n\n".join(parts) + "\n"


def _table(title: str, sentence: str, settings: Iterable[Setting]) -> list[str]:
    rows = ["| setting | default | unit | |", "|---|---|---|---|"]
    for each in settings:
        default = "required" if each.default is REQUIRED else f"`{_shown(each)}`"
        rows.append(f"| `{each.name}` | {default} | {each.kind.unit} | {each.sentence} |")
    return [f"## {title}", sentence, "\n".join(rows)]


def _shown(setting: Setting) -> str:
    return repr(setting.default) if not hasattr(setting.default, "name") else setting.default.name


def commands_page(commands: dict[str, argparse.ArgumentParser]) -> str:
    """Return the help texts of all commands."""
    parts = ["# Commands", "`--help` prints what is used most, `--help-all` prints everything, which is below."]
    for name, parser in commands.items():
        parts += [f"## {name}", f"```text\n{parser.format_help().rstrip()}\n```"]
    return "\n\n".join(parts) + "\n"
