# SPDX-License-Identifier: GPL-3.0-or-later
"""Open a sweep: write its page, serve it, draw figures, derive columns, embed, cluster, rank parameters.

The page is one HTML file beside the table. --serve adds live actions on 127.0.0.1, under a secret address.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path
from typing import Any

from spectral_core.cli.shared.outputs import require_outputs
from spectral_core.cli.shared.parser import without_companion
from spectral_core.cli.shared.report import print_json
from spectral_core.documents.toml import toml_text
from spectral_core.errors import InvalidInputError, counted

ERRORS = ("rmse", "delta_e_mean", "flip")
"""Columns of error against time where none are named."""

NAMED = {
    "p": "--norm", "the number of clusters": "--clusters", "the number of workers": "--workers", "the port": "--port",
}  # fmt: skip


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of ``spectral-scene explore``."""
    parser.add_argument(
        "folder", type=Path, metavar="FOLDER", help="a sweep's folder (.cdb), or any Cinema Spec D folder"
    )
    parser.add_argument("--out", type=Path, metavar="FILE.html", help="the page (default: explore.html in the folder)")
    parser.add_argument("--no-thumbnails", action="store_true", help="leave small pictures out of the page")
    parser.add_argument(
        "--figure", type=Path, metavar="FILE", help="draw the scatter-plot matrix as .png, .svg or .pdf"
    )
    parser.add_argument(
        "--columns", nargs="+", metavar="NAME", help="variables of the figure, or features of the analysis"
    )
    parser.add_argument("--color", metavar="NAME", help="variable that colors the figure")
    parser.add_argument(
        "--error-time", type=Path, metavar="FILE", help="draw error against time; --columns names the errors"
    )
    parser.add_argument("--by", nargs="+", default=[], metavar="NAME", help="factors that color error against time")
    parser.add_argument("--time", default="seconds", metavar="NAME", help="column of times (default seconds)")
    parser.add_argument(
        "--derive", nargs=2, action="append", default=[], metavar=("NAME", "EXPRESSION"), help="add a column"
    )
    parser.add_argument("--reference", metavar="KEY", help="measure every picture against that of this row")
    parser.add_argument("--distance", metavar="KEY", help="add the column distance: weighted distance to this row")
    parser.add_argument(
        "--weights",
        nargs="+",
        metavar="NAME=W",
        help='of --distance, such as lab_a=1 contrast=0.5; "pictures" weighs the pictures',
    )
    parser.add_argument(
        "--norm", type=float, default=2.0, metavar="P", help="of --distance: 1, 2, … or inf (default 2)"
    )
    parser.add_argument(
        "--embed", choices=["cosine", "centered", "gaussian", "simplex"], help="add embed_1 and embed_2"
    )
    parser.add_argument(
        "--clusters", type=int, metavar="K", help="add the column cluster from K clusters of the features"
    )
    parser.add_argument("--sensitivity", metavar="NAME", help="rank the parameters by their effect on a column")
    parser.add_argument("--propose", metavar="NAME", help="say which point to render next to make a column small")
    parser.add_argument(
        "--region",
        nargs=2,
        metavar=("COLUMN", "VALUE"),
        help="print the region around rows with a label, for a sweep file",
    )
    parser.add_argument("--serve", action="store_true", help="serve the page with live actions until Ctrl-C")
    parser.add_argument("--port", type=int, default=0, help="port of --serve; a free one by default")
    parser.add_argument("--workers", type=int, default=1, help="processes of --serve's renders")


def unused(arguments: argparse.Namespace) -> dict[str, str]:
    """Options that this call would ignore, with the reason of each."""
    ignored = without_companion(arguments, {
        "color": "figure", "by": "error_time", "time": "error_time", "weights": "distance", "norm": "distance",
        "port": "serve", "workers": "serve",
    })  # fmt: skip
    if not any((arguments.figure, arguments.error_time, arguments.embed, arguments.clusters is not None)):
        ignored["columns"] = "it needs --figure, --error-time, --embed or --clusters"
    if arguments.serve:
        ignored |= dict.fromkeys(("out", "no_thumbnails"), "with --serve no file is written")
    return ignored


def run(arguments: argparse.Namespace) -> int:
    """Run the requested analyses, then write or serve the page."""
    from spectral_core.explore.page.build import table_of_folder, table_of_store, write_page
    from spectral_core.explore.sweep.store import Store, cdb_folder

    folder = arguments.folder if (arguments.folder / "data.csv").is_file() else cdb_folder(arguments.folder)
    _check_outputs(arguments)
    if arguments.folder.is_file():
        raise InvalidInputError(
            f"{arguments.folder} is a file; name the folder of the sweep, by default the name of its document with "
            "the ending .cdb"
        )
    result: dict[str, Any] = {"folder": str(folder)}
    if not (folder / "project.json").is_file():
        if not (folder / "data.csv").is_file():
            raise InvalidInputError(
                f"{arguments.folder if arguments.folder.is_dir() else folder} holds no sweep (neither project.json nor "
                "data.csv); run one first with "
                "`spectral-scene sweep SWEEP.toml`, or name the folder of a Cinema database"
            )
        _refuse_analyses(arguments, folder)
        require_outputs(_outputs(arguments))
        table = table_of_folder(folder)
        _keep_pictures(arguments, folder, table)
        _figures(arguments, table)
    else:
        with Store.open(folder) as store:
            require_outputs(_outputs(arguments))
            store.recover()
            result |= _analyze(arguments, store)
            table = table_of_store(store)
            _keep_pictures(arguments, folder, table)
            _figures(arguments, table)
            if arguments.serve:
                return _serve(arguments, store)
    if arguments.out is None and not os.access(folder, os.W_OK):
        raise InvalidInputError(f"{folder} is read-only; name a file for the page elsewhere with --out PAGE.html")
    target = arguments.out or folder / "explore.html"
    write_page(target, table, thumbnails=not arguments.no_thumbnails)
    print(f"{counted(len(table.keys), 'point')}: {target}")
    result |= {"points": len(table.keys), "page": str(target)}
    if arguments.json:
        print_json(result)
    return 0


def _outputs(arguments: argparse.Namespace) -> list[Path]:
    """The files that the options name."""
    return [path for path in (arguments.out, arguments.figure, arguments.error_time) if path is not None]


def _check_outputs(arguments: argparse.Namespace) -> None:
    """Raise InvalidInputError for names that no page or figure can have, and for one file that gets two contents."""
    from spectral_core.explore.page.static import require_figure_name

    if arguments.out is not None and arguments.out.suffix.lower() not in (".html", ".htm"):
        raise InvalidInputError(f"the page ends in .html; got --out {arguments.out}")
    for path in filter(None, (arguments.figure, arguments.error_time)):
        require_figure_name(path)
    if arguments.figure and arguments.error_time and arguments.figure.resolve() == arguments.error_time.resolve():
        raise InvalidInputError(f"--figure and --error-time both name {arguments.figure}; give each a file of its own")


def _keep_pictures(arguments: argparse.Namespace, folder: Path, table: Any) -> None:
    """Raise InvalidInputError for a figure that would replace a picture of the table."""
    from spectral_core.cli.shared.outputs import require_apart
    from spectral_core.explore.sweep.cinema import is_file_column

    for path in (arguments.figure, arguments.error_time):
        if path is not None and folder.resolve() in path.resolve().parents:
            names = [column for name, column in table.columns.items() if is_file_column(name)]
            require_apart([path], (folder / name for column in names for name in column if name))


def _refuse_analyses(arguments: argparse.Namespace, folder: Path) -> None:
    """Raise InvalidInputError if columns are to be added to a table that is not a sweep's."""
    names = ("derive", "reference", "distance", "embed", "clusters", "sensitivity", "propose", "region", "serve")
    for name in names:
        given = getattr(arguments, name)
        if given is not None and given is not False and given != []:
            raise InvalidInputError(f"--{name} needs a sweep's folder; {folder} is a table without project.json")


def _analyze(arguments: argparse.Namespace, store: Any) -> dict[str, Any]:
    """The requested columns and analyses."""
    from spectral_core.explore.analysis import steps
    from spectral_core.explore.sweep.store import not_finite_note

    result: dict[str, Any] = {}
    for name, expression in arguments.derive:
        column = store.derive(name, expression)
        if None in column:
            print(f"note: {not_finite_note(name, column.count(None), len(column))}", file=sys.stderr)
    if arguments.reference:
        from spectral_core.explore.features.compare import compare_rows

        rows = {row.key: row for row in store.ledger.rows("done")}
        if arguments.reference not in rows or not rows[arguments.reference].files:
            raise InvalidInputError(f"no row with a picture has the key {arguments.reference!r}")
        files = rows[arguments.reference].files
        result["compared"] = compare_rows(store, files.get("FILE_linear") or files["FILE"])
    if arguments.distance:
        result["measured"] = steps.add_distance(store, arguments.distance, _weights(arguments.weights), arguments.norm)
        print(f"{counted(result['measured'], 'row')} measured: distance")
    if arguments.embed:
        steps.add_embedding(store, arguments.embed, arguments.columns)
    if arguments.clusters is not None:
        steps.add_clusters(store, arguments.clusters, arguments.columns)
    if arguments.sensitivity:
        result["sensitivity"] = steps.print_sensitivity(store, arguments.sensitivity)
    if arguments.propose:
        result["proposal"] = steps.proposed_point(store, arguments.propose)
        print(f"next: {json.dumps(result['proposal'], ensure_ascii=False)}")
    if arguments.region:
        result["region"] = steps.region_of_label(store, *arguments.region)
        print(toml_text({"region": result["region"]}), end="")
    if not store.ledger.is_read_only:
        store.write_table()
    for name, reason in store.not_computed.items():
        print(f"note: the column {name!r} is not computed: {reason}", file=sys.stderr)
    return result


def _weights(words: list[str] | None) -> dict[str, float]:
    """Weights by column of NAME=W words."""
    found = {}
    for word in words or []:
        name, _, number = word.partition("=")
        if name in found:
            raise InvalidInputError(f"--weights names {name!r} twice; name it once")
        try:
            found[name] = float(number)
        except ValueError as error:
            raise InvalidInputError(f"the weight {word!r} cannot be read; expected NAME=W, such as lab_a=1") from error
    if not found:
        raise InvalidInputError("--distance needs --weights, such as --weights lab_a=1 contrast=0.5")
    return found


def _figures(arguments: argparse.Namespace, table: Any) -> None:
    from spectral_core.explore.page.build import shown_at_first
    from spectral_core.explore.page.static import draw_error_against_time, draw_matrix
    from spectral_core.explore.sweep.cinema import is_file_column

    columns = dict(table.columns)
    parameters = [name for name, about in table.about.items() if about.get("role") == "parameter"]
    if arguments.figure:
        shown = arguments.columns or shown_at_first(table)
        logarithmic = [name for name, about in table.about.items() if about.get("log")]
        names = {"logarithmic": logarithmic, "parameters": parameters}
        drawn = draw_matrix(arguments.figure, columns, shown, color=arguments.color or "", **names)
        print(f"wrote {drawn}")
        others = [name for name in columns if not is_file_column(name) and name not in shown]
        if not arguments.columns and others:
            print(f"note: {arguments.figure} shows {len(shown)} of {len(shown) + len(others)} variables; name others "
                  f"with --columns: {', '.join(others)}")  # fmt: skip
    if arguments.error_time:
        errors = arguments.columns or [name for name in ERRORS if name in columns]
        if not errors:
            raise InvalidInputError(
                f"--error-time draws columns of error, and the table has none of {', '.join(ERRORS)}; name columns "
                "with --columns, or compare the pictures with --reference"
            )
        drawn = draw_error_against_time(
            arguments.error_time, columns, arguments.time, errors, by=arguments.by, parameters=parameters
        )
        print(f"wrote {drawn}")
    if arguments.figure or arguments.error_time:
        _note_fonts(columns)


def _note_fonts(columns: dict[str, Any]) -> None:
    """Say which characters of names and texts a figure cannot show."""
    from spectral_core.explore.features.expression import as_column
    from spectral_core.explore.page.fonts import without_font

    texts = (str(text) for values in columns.values() if as_column(values).dtype.kind != "f" for text in set(values))
    missing = without_font([*columns, *texts])
    if missing:
        print(
            f"note: no installed font has {missing[:20]}; figures show boxes there. Install one of that script, "
            "such as Noto Sans CJK (Debian: fonts-noto-cjk)",
            file=sys.stderr,
        )


def _serve(arguments: argparse.Namespace, store: Any) -> int:
    from spectral_core.explore.page.live import LiveSweep
    from spectral_core.explore.page.serve import PageServer
    from spectral_core.explore.sweep.sweep import DOCUMENT_FOLDER

    known = Path(store.project.environment.get(DOCUMENT_FOLDER, ""))
    live = LiveSweep(store, known if known.is_dir() and known.is_absolute() else Path.cwd(), workers=arguments.workers)
    with PageServer(live, arguments.port) as server:
        print(f"open {server.address}", flush=True)
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            print("stopped")
        finally:
            live.close()
    return 0
