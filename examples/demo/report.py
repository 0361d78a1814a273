# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo's report: one HTML page beside its pictures, with spectra, colors, errors and times."""

from __future__ import annotations

from html import escape
from pathlib import Path

from spectral_core.files.whole import write_text
from spectral_core.spectra import catalogue
from spectral_core.spectra.spectrum import Illuminant

from .charts import chart, css_color, swatch
from .run import DemoResult, Rendered

STYLE = """
body{font:16px/1.5 system-ui,sans-serif;color:#222;background:#faf9f7;max-width:1080px;margin:2em auto;padding:0 1em}
h1{font-weight:600;margin-bottom:.2em} h2{font-weight:600;margin-top:2em} .lead{font-size:1.15em;color:#444}
.pair{display:grid;grid-template-columns:repeat(auto-fit,minmax(320px,1fr));gap:1.2em} figure{margin:0}
figure img{width:100%;border-radius:4px} figcaption{color:#555;font-size:.95em;padding:.4em 0}
table{border-collapse:collapse} td,th{padding:.35em .9em .35em 0;text-align:left;border-bottom:1px solid #e5e2dd}
.swatch{display:inline-block;width:2.6em;height:1.5em;border-radius:3px;vertical-align:middle;border:1px solid #0002}
svg{width:100%;height:auto} .grid{stroke:#e2ded8} text{font:11px system-ui;fill:#666} .end{text-anchor:end}
.mid{text-anchor:middle} .small{color:#666;font-size:.9em}
"""


FILES = {
    "hidden_branch.blend": "the scene, to open in Blender with the extension",
    "palette.toml": "the wanted colors, to change and solve: spectral-scene design palette.toml",
    "glazes.csv": "the spectra of the two glazes",
    "swatches.ase, swatches.gpl": "the colors for painting programs",
    "under_D65.png, under_HP1.png": "the pictures above",
    "under_D65.spectral.exr, under_HP1.spectral.exr": "the same pictures with a spectrum in each pixel",
}


def write_report(demo: DemoResult) -> Path:
    """Write ``report.html`` into the demo's folder and return its path."""
    head = (
        f"<!doctype html><html lang='en'><meta charset='utf-8'><title>The hidden branch</title><style>{STYLE}</style>"
    )
    page = "\n".join([head, _head(demo), _spectra(demo), _colors(demo), _work(demo), "</html>"])
    path = demo.out / "report.html"
    write_text(path, page)
    return path


def _head(demo: DemoResult) -> str:
    figures = "".join(_figure(rendered) for rendered in demo.rendered)
    return (
        "<h1>The hidden branch</h1><p class='lead'>The vase has two glazes. In daylight they have one color, so the "
        "branch, which is the second glaze, cannot be seen. Under a street lamp the two glazes differ. Only the light "
        f"was changed.</p><div class='pair'>{figures}</div><p class='small'>ΔE2000 is a color difference: 0 is none, "
        "differences below 1 are invisible, and one of 5 is easy to see. The <i>mark</i> is the branch, the "
        "<i>ground</i> the glaze around it. Open hidden_branch.blend in Blender to change the light yourself.</p>"
    )


def _figure(rendered: Rendered) -> str:
    contrast = rendered.contrast
    return (
        f"<figure><img src='{rendered.picture.name}' alt='The vase under {escape(rendered.light.title)}'><figcaption>"
        f"{_title(rendered)}: in the picture's pixels the mark differs from "
        f"the ground beside it by <b>ΔE2000 {contrast.mean:.2f}</b> in the mean ({contrast.places} places)."
        f"{_dimmed(rendered.light.exposure)}"
        "</figcaption></figure>"
    )


def _title(rendered: Rendered) -> str:
    """Such as: Daylight (D65)."""
    title = rendered.light.title
    return escape(f"{title[:1].upper()}{title[1:]} ({rendered.light.name})")


def _dimmed(exposure: float) -> str:
    return "" if exposure == 1 else f" The lamp is set to {exposure:g} of the daylight's brightness."


def _spectra(demo: DemoResult) -> str:
    ground, mark = demo.solution.reflectances
    lights = [catalogue.illuminant(rendered.light.name) for rendered in demo.rendered]
    shown = [(Illuminant(light.name, light.grid, light.values / light.values.max()), color)
             for light, color in zip(lights, ("#4a7bb5", "#d9822b"), strict=True)]  # fmt: skip
    glazes = chart([(ground, "#8a8f5c"), (mark, "#7a3b2e")], title="Reflectance of the two glazes", top=1.0)
    return (
        "<h2>Why it works</h2><div class='pair'><figure>" + glazes + "<figcaption>How much of the light each glaze "
        "reflects at each wavelength (1 is all of it): the ground green, the mark brown. Daylight holds all "
        "wavelengths, and the eye adds them to one color. Sodium light is strong near 590 nm only, where the glazes "
        "differ.</figcaption>"
        "</figure><figure>" + chart(shown, title="The two lights") + "<figcaption>Daylight D65 (blue) and a "
        "high-pressure sodium lamp, HP1 (orange): light at each wavelength, as a share of its maximum."
        "</figcaption></figure></div>"
    )


def _colors(demo: DemoResult) -> str:
    solution = demo.solution
    titles = [_title(rendered) for rendered in demo.rendered]
    rows = []
    for i, glaze in enumerate(item.name for item in solution.problem.reflectances):
        cells = []
        for j, title in enumerate(titles):
            wanted, got = solution.target_linear_rgb[i, j], solution.actual_linear_rgb[i, j]
            cells.append(f"<td>{swatch(wanted, f'wanted: {title}')} {swatch(got, f'actual: {title}')} "
                         f"ΔE {solution.delta_e_2000[i, j]:.2f}</td>")  # fmt: skip
        rows.append(f"<tr><th>{escape(glaze)}</th>{''.join(cells)}</tr>")
    measured = "".join(
        f"<tr><th>{_title(r)}</th>"
        f"<td>{swatch(r.contrast.ground_rgb)} {css_color(r.contrast.ground_rgb)}</td>"
        f"<td>{swatch(r.contrast.mark_rgb)} {css_color(r.contrast.mark_rgb)}</td>"
        f"<td>{r.contrast.mean:.2f}</td><td>{r.contrast.largest:.2f}</td></tr>"
        for r in demo.rendered
    )
    head = "".join(f"<th>{title}</th>" for title in titles)
    return (
        f"<h2>Colors</h2><p>Designed spectra: the wanted color at the left, the actual color at the right, and their "
        f"difference.</p><table><tr><th></th>{head}</tr>{''.join(rows)}</table>"
        "<p>Rendered pictures: measured in their pixels, along the mark's edge.</p><table><tr><th>light</th>"
        f"<th>ground</th><th>mark</th><th>mean ΔE2000</th><th>largest</th></tr>{measured}</table>"
        "<p class='small'>Linear sRGB, white = D65; colors outside the screen's range are shown at its edge. Noise of "
        "the render counts as difference: at few samples or a small size the mark seems to differ in daylight, too. "
        f"Status of the design: {solution.status}; residual of its optimality check: {solution.kkt_residual:.1e} "
        "(0 at the optimum).</p>"
    )


def _work(demo: DemoResult) -> str:
    times = "".join(f"<tr><th>{escape(name)}</th><td>{value:.1f} s</td></tr>" for name, value in demo.seconds.items())
    plan = demo.rendered[0].result.plan
    decisions = "".join(
        f"<tr><th>{escape(_words(d.name))}</th><td>{escape(_words(str(d.value)))}</td><td>{escape(d.reason)}</td></tr>"
        for d in plan.decisions
    )
    result = demo.rendered[0].result
    files = "".join(f"<tr><th>{name}</th><td>{text}</td></tr>" for name, text in FILES.items())
    return (
        "<h2>Simulated effects</h2><p>The renderer leaves out the effects that this scene does not need. "
        f"{result.samples} samples per pixel; Mitsuba's variant {escape(result.variant)}.</p>"
        f"<table>{decisions}</table><h2>Time</h2><table>{times}</table>"
        f"<h2>Files beside this page</h2><table>{files}</table>"
    )


def _words(identifier: str) -> str:
    """An effect or its value as the panel in Blender names it."""
    return {"rgb": "RGB"}.get(identifier) or identifier.replace("_", " ").capitalize()
