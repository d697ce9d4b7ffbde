#include "core/garment_archive.h"
#include "core/io/cameras_file.h"
#include "core/io/image_file.h"
#include "core/io/lower_extension.h"
#include "core/io/mesh_file.h"
#include "core/io/mesh_sequence_file.h"
#include "core/io/one_file_sequence.h"
#include "core/io/sequence_folder.h"
#include "core/sequence_archive.h"
#include "python/arrays.h"
#include "python/bindings.h"
#include "python/checks.h"
#include "python/images.h"
#include "python/signals.h"

namespace atelier::python {
namespace {

using namespace py::literals;
using Path = std::filesystem::path;

MeshConvention convention_of(double metres_per_unit, const std::string& up) {
  if (up != "x" && up != "y" && up != "z") {
    throw DataError("", "up", "'" + up + "'", "x, y or z");
  }
  if (!(metres_per_unit > 0) || !std::isfinite(metres_per_unit)) {
    throw DataError("", "metres_per_unit", std::to_string(metres_per_unit), "a number above 0");
  }
  return {.metres_per_unit = metres_per_unit, .up = up[0]};
}

void bind_meshes(py::module_& module) {
  module.def(
      "read_mesh",
      [](const Path& path, double metres_per_unit, const std::string& up) {
        return read_mesh(path, convention_of(metres_per_unit, up));
      },
      "path"_a, "metres_per_unit"_a = 1.0, "up"_a = "y", py::call_guard<LongCall>(),
      "OBJ, PLY, glTF, FBX or USD in metres, Y up; unit and axis are of files that do not say "
      "theirs.");
  module.def(
      "write_mesh",
      [](const Path& path, const Mesh& mesh) {
        const std::string extension = lower_extension(path);
        if (extension != ".obj" && extension != ".ply" && extension != ".glb" &&
            extension != ".gltf") {
          throw DataError(path.string(), "", "the extension '" + extension + "'",
                          ".obj, .ply, .glb or .gltf");
        }
        require_faces(mesh.faces, mesh.vertices.rows());
        write_mesh(path, mesh);
      },
      "path"_a, "mesh"_a, py::call_guard<LongCall>(), "By extension: .obj, .ply, .glb, .gltf.");
  module.def(
      "read_mesh_archive", [](const Path& path) { return read_mesh_archive(path); }, "path"_a,
      py::call_guard<LongCall>(),
      "A mesh of schema atelier.mesh (.h5): scans, frames of a workspace.");
  module.def("write_mesh_archive", &write_mesh_archive, "path"_a, "mesh"_a,
             py::call_guard<LongCall>(), "A mesh as atelier.mesh (.h5), whole or not at all.");
  module.def(
      "open_sequence", [](const Path& folder) { return open_sequence(folder); }, "folder"_a,
      py::call_guard<LongCall>(), "A sequence of Atelier: sequence.h5 and frames/.");
  module.def(
      "read_sequence_folder",
      [](const Path& path, double metres_per_unit, const std::string& up) {
        return read_sequence_folder(path, convention_of(metres_per_unit, up));
      },
      "path"_a, "metres_per_unit"_a = 1.0, "up"_a = "y", py::call_guard<LongCall>(),
      "A folder of meshes, one file a frame, whose names end in the frame's number.");
  module.def(
      "read_mesh_sequence",
      [](const Path& path, const std::string& what) {
        if (what != "cloth" && what != "body") {
          throw DataError("", "what", "'" + what + "'", "\"cloth\" or \"body\"");
        }
        return read_mesh_sequence(path, what == "body" ? SequenceOf::Body : SequenceOf::Cloth)
            .sequence;
      },
      "path"_a, "what"_a = "cloth", py::call_guard<LongCall>(),
      "Meshes over one topology, of a folder or one file (.npz, .h5, .usdc); of a file with "
      "`body_vertices` and `cloth_vertices` those of `what`, \"cloth\" or \"body\".");
  module.def("write_sequence", &write_sequence, "folder"_a, "sequence"_a,
             py::call_guard<LongCall>(), "sequence.h5 and a file for each frame.");
  module.def("write_one_file_sequence", &write_one_file_sequence, "path"_a, "sequence"_a,
             py::call_guard<LongCall>(), "One archive of all frames, vertices as float32.");
}

void bind_garments(py::module_& module) {
  module.def(
      "read_garment_archive", [](const Path& path) { return read_garment_archive(path); }, "path"_a,
      py::call_guard<LongCall>(), "A garment of schema atelier.garment (.h5).");
  module.def("write_garment_archive", &write_garment_archive, "path"_a, "garment"_a,
             py::call_guard<LongCall>(),
             "A garment as atelier.garment (.h5), whole or not at all.");
  module.def(
      "read_cameras", [](const Path& folder) { return read_cameras(folder); }, "folder"_a,
      py::call_guard<LongCall>(), "Those of cameras.json in a folder.");
}

void bind_images(py::module_& module) {
  module.def(
      "read_image",
      [](const Path& path, bool keep_alpha) {
        Image image;
        {
          const LongCall released;
          image = read_image(path, ImageReadOptions{.keep_alpha = keep_alpha});
        }
        return image_array(std::move(image));
      },
      "path"_a, "keep_alpha"_a = false, "Linear light, float32 [H,W] or [H,W,C].");
  module.def(
      "read_byte_image",
      [](const Path& path, bool keep_alpha) {
        ByteImage image;
        {
          const LongCall released;
          image = read_byte_image(path, keep_alpha);
        }
        return image_array(std::move(image));
      },
      "path"_a, "keep_alpha"_a = false, "sRGB bytes, uint8 [H,W] or [H,W,C].");
  module.def(
      "read_labels",
      [](const Path& path) {
        ByteImage image;
        {
          const LongCall released;
          image = read_labels(path);
        }
        return image_array(std::move(image));
      },
      "path"_a, "A label map of a PNG, uint8 [H,W].");
  module.def(
      "write_image",
      [](const Path& path, const py::array& image, int quality, int bit_depth) {
        if (!image_format_of_name(path)) {
          throw DataError(path.string(), "", "the extension '" + lower_extension(path) + "'",
                          ".png, .jpg, .jpeg, .tif, .tiff, .webp, .bmp or .avif");
        }
        const ImageWriteOptions options{.quality = quality, .bit_depth = bit_depth};
        if (image.dtype().kind() == 'u') {
          const ByteImage bytes = image_of<std::uint8_t>(image);
          const LongCall released;
          write_image(path, bytes, options);
        } else {
          const Image linear = image_of<float>(image);
          const LongCall released;
          write_image(path, linear, options);
        }
      },
      "path"_a, "image"_a, "quality"_a = 95, "bit_depth"_a = 8,
      "By extension; floating numbers are linear light, uint8 is sRGB.");
}

}  // namespace

void bind_files(py::module_& module) {
  bind_meshes(module);
  bind_garments(module);
  bind_images(module);
}

}  // namespace atelier::python
