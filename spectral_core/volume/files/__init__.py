# SPDX-License-Identifier: GPL-3.0-or-later
"""Scalar volumes from and to files: ``read_volume(path)`` detects the format by the file's first bytes.

======== =============================== =========================================================================
format   files                           what gives size, spacing and orientation
======== =============================== =========================================================================
nrrd     .nrrd .nhdr                     the header: space directions and origin, or spacings (read by pynrrd)
meta     .mhd .mha                       the header (own reader)
dat      .dat                            the header of the volvis and Inviwo kind (own reader)
raw      .raw .bin .img                  ``RawLayout``, or a name such as ``foot_256x256x256_uint8.raw``
nifti    .nii .nii.gz .hdr/.img          the affine of the header, RAS+ (read by nibabel)
vtk      .vtk                            structured points, ASCII and binary (own reader)
vti      .vti                            image data, every encoding and compressor but LZ4 without lz4 (own reader)
numpy    .npy .npz                       axis 0 is x; in .npz ``spacing``, ``origin`` or ``to_world`` beside the data
tiff     .tif .tiff, a folder of them    ImageJ and OME metadata (read by tifffile)
openvdb  .vdb                            the grid's transform (Blender's openvdb, or own code)
======== =============================== =========================================================================

VTK's image data are two small, stable formats, and the ``vtk`` package weighs over 100 MB: hence own readers for them.
Coordinates are the file's own: nothing is flipped between RAS (NIfTI) and LPS (most NRRD); a file's first voxel axis
is x of ``ScalarVolume``. The data keep their type. A file that is cut, too long or of another kind is refused.
"""

from spectral_core.volume.files.read import read_volume
from spectral_core.volume.files.registry import VolumeFormat, detect_format, known_formats
from spectral_core.volume.files.request import RawLayout
from spectral_core.volume.files.sequence import VolumeSequence, find_sequence, sequence_of
from spectral_core.volume.files.write import write_volume

__all__ = [
    "RawLayout",
    "VolumeFormat",
    "VolumeSequence",
    "detect_format",
    "find_sequence",
    "known_formats",
    "read_volume",
    "sequence_of",
    "write_volume",
]
