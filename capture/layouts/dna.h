#pragma once

#include "capture/layouts/layout.h"

namespace atelier {

/// DNA-Rendering (scripts/3DGS/SMCReader.py of its repository): main/<id>.smc and annotations/
/// <id>_annots.smc, HDF5 with encoded pictures, read through foreign_hdf5 in a process of its own.
/// RT takes the camera into the world; K and D are OpenCV's, the first pixel's centre at (0, 0).
/// World: metres. Camera ids appear as "3" and "03". 15 frames per second.
///
/// Every reading starts a process that takes the whole file into memory: files beyond
/// Limits::worker_memory_bytes are refused, and frames are read for all cameras at once.
std::string recognize_dna(const std::filesystem::path& path);
Dataset read_dna(const std::filesystem::path& path, const DatasetOptions& options,
                 const Limits& limits);
std::vector<std::string> write_dna(const LayoutSource& source, const std::filesystem::path& out);

}  // namespace atelier
