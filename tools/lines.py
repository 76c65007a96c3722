"""Count files and lines of code of each area, without blanks, comments and docstrings: ``tools/lines.py [ROOT]``."""

import ast
import io
import re
import sys
import tokenize
from pathlib import Path

AREAS = {
    "core": ["rust/core/src"],
    "binding": ["rust/python/src"],
    "package": ["python/ttc_fast"],
    "tests": ["tests", "rust/core/tests"],
    "benches": ["benches", "rust/benches"],
    "evaluation": ["evaluation"],
    "tools": ["tools"],
}


def code_lines(path: Path) -> int:
    """Return the number of lines that hold code; strings that stand alone are docstrings."""
    text = path.read_text(encoding="utf-8")
    if path.suffix != ".py":
        lines = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL).splitlines()
        return sum(bool(line.strip()) and not line.strip().startswith("//") for line in lines)
    alone = (node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Expr))
    docs = [node for node in alone if isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)]
    empty = {line for node in docs for line in range(node.lineno, (node.end_lineno or 0) + 1)}
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    code = [each for each in tokens if each.string.strip() and each.type != tokenize.COMMENT]
    return len({line for each in code for line in range(each.start[0], each.end[0] + 1)} - empty)


root = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
for area, folders in AREAS.items():
    files = [
        path for each in folders for path in (root / each).rglob("*") if path.suffix in (".py", ".pyi", ".rs", ".cpp")
    ]
    print(f"{area:10} {len(files):4} files {sum(map(code_lines, files)):6} lines of code")
