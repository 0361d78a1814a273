# SPDX-License-Identifier: GPL-3.0-or-later
"""Hostile expressions, texts, paths and requests: a list, and as many random ones from a seed."""

from __future__ import annotations

import random
import string
from collections.abc import Iterator
from typing import Any

EXPRESSIONS = [
    "__import__('os').system('touch CANARY')", "open('CANARY', 'w')", "().__class__.__bases__[0].__subclasses__()",
    "[x for x in range(10**9)]", "sum(x for x in a)", "(lambda: (yield))()", "(lambda f: f(f))(lambda f: f(f))",
    "a.__class__", "a.tofile('CANARY')", "a[0]", "a[::-1]", "exec('import os')", "eval('1')",
    "compile('1', '', 'eval')",
    "{'a': 1}", "{1, 2}", "f'{a.__class__}'", "f'{open(1)}'", "(b := 3)", "'x' * 10**9", "[0] * 10**10", "b'x' * 10**9",
    "10**10**10**10", "9**9**9**9**9", "(a" + "**9" * 90 + ")", "1 << 10**9", "a @ b", "~a", "import os", "a; b",
    "a\nimport os",
    "print(a)", "getattr(a, 'x')", "globals()", "vars()", "breakpoint()", "input()", "*a", "...", "None", "await a",
    "yield",
    "while 1: pass", "for x in a: x", "del a", "a = 1", "assert a", "raise a", "a if b", "sqrt(x=a)", "max(*a)",
    "max(**a)",
    "sqrt.__globals__", "where.__self__", "(sqrt)(a)(b)", "unknown(a)", "rank(rank", "a" * 5000,
    "(" * 900 + "a" + ")" * 900,
    "-" * 1500 + "a", "a+" * 900 + "a", "min(" * 60 + "a" + ",a)" * 60, "9" * 1900, "1e999", "1j", "b'x'", "a\0b",
    "\ud800", "ａ+1",
    "a if a else " * 100 + "a", "not " * 400 + "a", "a<" * 300 + "a", "'" + "x" * 1500 + "'", "max(a, 'x')",
    "name * 10**9",
    "name ** name", "1/0", "0**-1", "a // 0 % 0", "mean(name)", "1e300*1e300", "# a", "", "   ", "\\",
    "'\\N{DIGIT ONE}'",
    "{{a}}", "@a", "a -> b", "a!", "$a", "`a`", "\u202ea", "async def f(): pass", "(yield from a)",
    "match a: case 1: pass",
]  # fmt: skip
_WORDS = [
    "a", "b", "name", "1", "2.5", "1e308", "0", "+", "-", "*", "**", "/", "//", "%", "(", ")", ",", "sqrt", "where",
    "rank", "min",
    "'x'", "<", "==", "and", "or", "not", "if", "else", "__class__", "__import__", ".", "[", "]", "{", "}", "lambda",
    ":", ":=",
    "import", "open", "exec", "for", "in", "f'{a}'", "yield", "\\", "@", "~", "<<", "is", "None", "True",
]  # fmt: skip
TEXTS = [
    "=1+1", "+1", "-2+3", "@SUM(A1)", "\t=1", "\r=1", "\n=1", "=cmd|' /C calc'!A0", "=HYPERLINK(\"http://x\",\"y\")",
    '=1","=2',
    "'=1", "</script><script>window.evil=1</script>", "<img src=x onerror=window.evil=1>",
    "<svg/onload=window.evil=1>", "<!--",
    "--><script>window.evil=1</script>", "]]>", "&lt;script&gt;", "javascript:window.evil=1", "\u2028window.evil=1",
    "\\u003cscript>",
    "{{7*7}}", "${window.evil=1}", '"onmouseover="window.evil=1', "'><b id=evil>", "a,b\nc,d", 'a"b', "\x00=1",
    "\ufeff=1", "＝1+1",
    "</title><script>window.evil=1</script>", "</SCRIPT ><iframe src=javascript:window.evil=1>", "__proto__",
    "constructor", "%s%n",
]  # fmt: skip
PATHS = [
    "lights[Kei].power_w", "lights[Key].__class__", "lights[Key].power_w.real", "lights[-9].power_w", "lights",
    "lights[Key]",
    "__dict__", "__class__.__init__", "lights[Key].power_w()", "lights[__import__('os')].x",
    "camera.world_from_camera[9,9]",
    "camera.world_from_camera[0]", "camera.world_from_camera[1e9]", "camera..x", ".camera", "camera.", "[", "]",
    "[[]]", "a" * 401,
    "../../etc/passwd", "lights[../x].power_w", "film.width.bit_length", "settings._x", "film\0.samples",
    "film .samples", "\n", "",
    "materials[metal].surface.roughness[0]", "materials[metal].surface.nothing", "lights[Key].name.upper",
    "ｆilm.nothing",
]  # fmt: skip
GOOD_PATHS = [
    "lights[Key].power_w",
    "film.width",
    "camera.world_from_camera[2,3]",
    "materials[metal].surface.roughness",
]
GOOD_DATA_PATHS = ['bpy.data.lights["Key"].energy', 'bpy.data.lights["Key"].color[1]',
'bpy.data.objects["Camera"].hide_render',
                   'bpy.data.lights["Key"].type']  # fmt: skip
DATA_PATHS = [
    'bpy.data.lights["None"].energy', 'bpy.data.lights["Key"].nothing', 'bpy.data.lights["Key"].energy; 1',
    "__import__('os')",
    'bpy.data.objects["Camera"].location[7]', 'bpy.data.objects["Camera"].location',
    'bpy.data.objects["Camera"].__class__',
    'bpy.data.objects["Camera"].name', "../x", "", "bpy.ops.wm.quit_blender()", "bpy.data.lights[0].energy", "bpy.data",
    'bpy.data.lights["Key"].bl_rna', 'bpy.data.lights["Key"].animation_data_create', 'bpy.data.lights["Key"]["none"]',
    'bpy.data.libraries.load("x")', 'bpy.data.texts["x"].as_string()', 'bpy.context.scene',
    'bpy.data.lights["Key"].energy[0]',
    'bpy.data.lights["Key"].color[3]', 'bpy.data.lights["Key"].color[-1]', 'bpy.data.lights["Key"].users', "\0",
    "bpy.data.lights[",
]  # fmt: skip
FILE_NAMES = [
    "../../etc/passwd", "/etc/passwd", "image/../../x.png", "..", "image/..", "..\\x.png", "C:\\x.png", "\0.png",
    "image/link.png",
    "image/deep/../../../x", "~/x", "file:///etc/passwd", "//server/share", "./../../x", "image/%2e%2e/x",
]  # fmt: skip


def expressions(count: int, seed: int = 5) -> Iterator[str]:
    """The listed expressions, then random ones of words and of any letters, then listed ones with an edit."""
    yield from EXPRESSIONS
    rng = random.Random(seed)
    for number in range(count):
        if number % 3 == 0:
            yield " ".join(rng.choice(_WORDS) for _ in range(rng.randint(1, 12)))
        elif number % 3 == 1:
            yield "".join(rng.choice(string.printable + "éß手\u200b\x00") for _ in range(rng.randint(1, 40)))
        else:
            yield edited(rng.choice(EXPRESSIONS)[:300], rng)


def edited(text: str, rng: random.Random) -> str:
    """A text with a letter left out, doubled, or replaced."""
    if not text:
        return rng.choice(string.punctuation)
    at = rng.randrange(len(text))
    return text[:at] + rng.choice(["", text[at] * 2, rng.choice(string.printable)]) + text[at + 1 :]


def texts(count: int, seed: int = 6) -> list[str]:
    """The listed texts, joined in random pairs."""
    rng = random.Random(seed)
    return TEXTS + [rng.choice(TEXTS) + rng.choice(TEXTS) for _ in range(count)]


def paths(known: list[str], good: list[str], count: int, seed: int = 7) -> list[str]:
    """The listed paths ``known``, and edited ones of them and of ``good``."""
    rng = random.Random(seed)
    pool = known + good * (len(known) // len(good))
    return known + [edited(edited(rng.choice(pool)[:200], rng), rng) for _ in range(count)]


def contents(count: int, seed: int = 8) -> Iterator[tuple[str, Any]]:
    """Actions of the served page with contents of the wrong type, from a page that has the token."""
    rng = random.Random(seed)
    actions = [
        "sample",
        "refine",
        "render",
        "derive",
        "distance",
        "label",
        "apply",
        "status",
        "store",
        "__class__",
        "_add",
        "",
    ]
    names = ["region", "budget", "name", "expression", "values", "key", "weights", "p", "__proto__"]
    region = {
        "ranges": {"a": [10**400, 1]},
        "constraints": ["a <= 1" + "0" * 400],
        "ball": {"center": {"a": "x"}, "radii": {}},
    }
    leaves: list[Any] = [None, True, -1, 10**400, 1e308, "", "a", "=1", "../x", "\ud800", [], {}, [[]],
    {"a": {"b": []}}, "x" * 5000,
                         region, {"ranges": {"a": [0.9, 0.1]}}, {"ranges": {"a": 3}}, {"constraints": [7]},
                         {"a": "=1+1"}]  # fmt: skip
    for _ in range(count):
        action = rng.choice(
            [name for name in actions if name not in ("refine", "render")] if rng.random() < 0.99 else ["refine"]
        )
        yield action, {rng.choice(names): rng.choice(leaves) for _ in range(rng.randint(0, 4))}
