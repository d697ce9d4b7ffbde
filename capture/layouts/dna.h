#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "capture/layouts/layout.h"
#include "core/io/foreign_hdf5.h"

namespace atelier {

/// DNA-Rendering (scripts/3DGS/SMCReader.py of its repository): `main/<id>.smc` and annotations/
/// `<id>_annots.smc`, HDF5 with encoded images, read through foreign_hdf5 in a process of its
/// own. RT takes the camera into the world; K and D are OpenCV's, the first pixel's centre at (0,
/// 0). World: metres. Camera ids appear as "3" and "03". 15 frames per second.
///
/// Every reading starts a process that takes the whole file into memory: files beyond
/// Limits::worker_memory_bytes are refused, and frames are read for all cameras at once.
std::string recognize_dna(const std::filesystem::path& path);
Dataset read_dna(const std::filesystem::path& path, const DatasetOptions& options,
                 const Limits& limits);

/// The two files of a capture, as far as their listings say.
struct DnaFiles {
  std::filesystem::path main;
  std::filesystem::path annotations;
  ForeignHdf5Contents in_main;
  ForeignHdf5Contents in_annotations;
};
/// The capture in them; `read` gives arrays of the annotations by their names. Throws DataError for
/// cameras that are no cameras, arrays of other shapes, and more frames than Limits::frames.
Dataset dna_dataset(
    const DnaFiles& files,
    const std::function<std::map<std::string, Tensor>(const std::vector<std::string>&)>& read,
    const Limits& limits = {});

std::vector<std::string> write_dna(const LayoutSource& source, const std::filesystem::path& out);

}  // namespace atelier
