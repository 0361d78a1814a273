# SPDX-License-Identifier: GPL-3.0-or-later
"""Small glTF files, one per material extension that Blender imports, written without Blender."""

from __future__ import annotations

import json
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np

_BASE = {"baseColorFactor": [0.7, 0.35, 0.2, 1.0], "roughnessFactor": 0.35, "metallicFactor": 0.0}
MATERIALS: dict[str, dict[str, Any]] = {
    "KHR_materials_clearcoat": {"clearcoatFactor": 0.8, "clearcoatRoughnessFactor": 0.1},
    "KHR_materials_sheen": {"sheenColorFactor": [0.3, 0.5, 0.9], "sheenRoughnessFactor": 0.5},
    "KHR_materials_transmission": {"transmissionFactor": 0.7},
    "KHR_materials_ior": {"ior": 1.8},
    "KHR_materials_specular": {"specularFactor": 0.4, "specularColorFactor": [1.0, 0.5, 0.3]},
    "KHR_materials_emissive_strength": {"emissiveStrength": 2.5},
    "KHR_materials_anisotropy": {"anisotropyStrength": 0.7, "anisotropyRotation": 0.6},
    "KHR_materials_volume": {"thicknessFactor": 1.0, "attenuationDistance": 0.8, "attenuationColor": [0.4, 0.8, 0.9]},
    "KHR_materials_unlit": {},
    "KHR_materials_iridescence": {"iridescenceFactor": 1.0, "iridescenceThicknessMaximum": 400.0},
    "KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": 0.6},
    "KHR_materials_dispersion": {"dispersion": 4.0},
}
"""Extensions of a material, with numbers that have a visible effect."""
OTHERS = ("KHR_texture_transform", "alpha_mask", "alpha_blend", "vertex_colors", "KHR_lights_punctual",
          "EXT_mesh_gpu_instancing")  # fmt: skip


def write_files(folder: Path) -> list[Path]:
    """One .glb per extension, in ``folder``."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for name in (*MATERIALS, *OTHERS):
        path = folder / f"{name}.glb"
        path.write_bytes(_file(name))
        paths.append(path)
    return paths


def _file(name: str) -> bytes:
    positions, normals, uv, triangles = _sphere()
    colors = np.concatenate([np.abs(normals), np.ones((len(normals), 1))], axis=1).astype(np.float32)
    offsets = np.array([[-1.2, 0, 0], [1.2, 0, 0], [0, 1.4, 0]], np.float32)
    arrays = [("VEC3", positions), ("VEC3", normals), ("VEC2", uv), ("SCALAR", triangles), ("VEC4", colors)]
    arrays.append(("VEC3", offsets))
    material: dict[str, Any] = {"name": name, "pbrMetallicRoughness": dict(_BASE)}
    primitive = {"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3, "material": 0}
    node: dict[str, Any] = {"mesh": 0}
    document: dict[str, Any] = {"asset": {"version": "2.0"}, "scene": 0, "extensionsUsed": []}
    nodes = [node]
    if name in MATERIALS:
        material["extensions"] = {name: MATERIALS[name]}
        if name == "KHR_materials_emissive_strength":
            material["emissiveFactor"] = [0.2, 0.5, 0.1]
        if name in ("KHR_materials_volume", "KHR_materials_dispersion"):
            material["extensions"]["KHR_materials_transmission"] = {"transmissionFactor": 1.0}
        document["extensionsUsed"] = sorted(material["extensions"])
    elif name == "KHR_texture_transform":
        transform = {"offset": [0.1, 0.2], "rotation": 0.5, "scale": [3.0, 2.0]}
        material["pbrMetallicRoughness"] |= {
            "baseColorFactor": [1.0, 1.0, 1.0, 1.0],
            "baseColorTexture": {"index": 0, "extensions": {name: transform}},
        }
        document["extensionsUsed"] = [name]
    elif name in ("alpha_mask", "alpha_blend"):
        material |= {"alphaMode": name[6:].upper(), "doubleSided": True}
        material["pbrMetallicRoughness"] |= {"baseColorTexture": {"index": 0}}
    elif name == "vertex_colors":
        primitive["attributes"]["COLOR_0"] = 4
    elif name == "KHR_lights_punctual":
        lights = [
            {"type": "point", "intensity": 60.0, "color": [1.0, 0.4, 0.2]},
            {"type": "spot", "intensity": 300.0, "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.5}},
        ]
        document["extensions"], document["extensionsUsed"] = {name: {"lights": lights}}, [name]
        nodes += [{"translation": [2.0, 1.0, 1.5], "extensions": {name: {"light": 0}}}]
        nodes += [{"translation": [0.0, 0.0, 4.0], "extensions": {name: {"light": 1}}}]
    elif name == "EXT_mesh_gpu_instancing":
        node["extensions"] = {name: {"attributes": {"TRANSLATION": 5}}}
        document["extensionsUsed"] = [name]
    document |= {
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": [{"primitives": [primitive]}],
        "materials": [material],
        "textures": [{"source": 0}],
    }
    return _glb(document, arrays, _checker())


def _sphere(rings: int = 24) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    v, u = np.meshgrid(np.linspace(0, 1, rings + 1), np.linspace(0, 1, 2 * rings + 1), indexing="ij")
    polar, around = np.pi * v, 2 * np.pi * u
    points = np.stack([np.sin(polar) * np.cos(around), np.cos(polar), np.sin(polar) * np.sin(around)], axis=-1)
    points = points.reshape(-1, 3).astype(np.float32)
    row, column = np.meshgrid(np.arange(rings), np.arange(2 * rings), indexing="ij")
    first = (row * (2 * rings + 1) + column).ravel()
    below = first + 2 * rings + 1
    triangles = np.stack([first, first + 1, below, first + 1, below + 1, below], axis=-1)
    return points, points, np.stack([u.ravel(), v.ravel()], axis=-1).astype(np.float32), triangles.astype(np.uint32)


def _checker(size: int = 64) -> bytes:
    """A PNG of colored squares, some of which are half transparent."""
    row, column = np.mgrid[:size, :size] // 8
    pixels = np.stack([40 + 25 * row, 40 + 25 * column, 120 + 0 * row, 255 - 128 * ((row + column) % 2)], axis=-1)
    lines = b"".join(b"\0" + line.tobytes() for line in pixels.astype(np.uint8))

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", size, size, 8, 6, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(lines)) + chunk(b"IEND", b"")


def _glb(document: dict[str, Any], arrays: list[tuple[str, np.ndarray]], image: bytes) -> bytes:
    views, accessors, data = [], [], b""
    for kind, array in arrays:
        raw = array.tobytes()
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(raw)})
        count = array.size if kind == "SCALAR" else len(array)
        entry: dict[str, Any] = {"bufferView": len(views) - 1, "type": kind, "count": count}
        entry["componentType"] = 5125 if array.dtype == np.uint32 else 5126
        if kind == "VEC3":
            entry |= {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
        accessors.append(entry)
        data += raw
    views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(image)})
    data += image + b"\0" * (-len(image) % 4)
    document |= {
        "bufferViews": views,
        "accessors": accessors,
        "buffers": [{"byteLength": len(data)}],
        "images": [{"bufferView": len(views) - 1, "mimeType": "image/png"}],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    total = 12 + 8 + len(text) + 8 + len(data)
    head = struct.pack("<4sII", b"glTF", 2, total)
    return head + struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
