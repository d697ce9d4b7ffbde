#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/new_folders.h"
#include "core/store/workspace_status.h"

namespace atelier {

/// Format of exported meshes.
enum class ExportFormat { Ply, Obj, Glb, Usda, Hdf5 };

/// Takes what was written, as whole lines.
using SayLines = std::function<void(const std::string& lines)>;

/// Takes away again what an export has made that was refused on its way, so that the next one finds
/// the place free.
class ExportGuard {
 public:
  explicit ExportGuard(const std::filesystem::path& out) : above_(out) {}
  ~ExportGuard();
  ExportGuard(const ExportGuard&) = delete;
  ExportGuard& operator=(const ExportGuard&) = delete;

  /// A folder that is not there yet.
  void add(const std::filesystem::path& place) { places_.push_back(place); }
  void release() { armed_ = false; }

 private:
  NewFolders above_;
  std::vector<std::filesystem::path> places_;
  bool armed_ = true;
};

/// A capture's cameras, with the images of its first instant, in a layout of captures.
void export_cameras(const std::filesystem::path& capture, const std::filesystem::path& place,
                    const std::string& layout, ExportGuard& guard, const SayLines& say);

/// Exports one sound result to a folder of the stage's name: sequences and meshes in the format,
/// motions as BVH and TRC too, what `animate` made as one scene, all else as it is; beside them the
/// consent of the people.
/// @param out  folder of all results
void export_result(const StageStatus& status, const std::filesystem::path& workspace,
                   const std::filesystem::path& out, ExportFormat format, ExportGuard& guard,
                   const SayLines& say);

}  // namespace atelier
