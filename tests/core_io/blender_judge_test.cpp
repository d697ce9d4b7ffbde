// Blender reads what we write: counts, bounds, texture coordinates and colours, each as it stands
// in Blender's own mesh. Skips where Blender is not installed (scripts/setup --judges).

#include <fstream>
#include <map>
#include <sstream>

#include <gtest/gtest.h>

#include "core/io/mesh_gltf.h"
#include "core/io/mesh_obj.h"
#include "core/io/mesh_ply.h"
#include "tests/support/child_process.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

// Prints a line for each file: name, vertices, triangles, least and greatest corner, largest error
// of texture coordinates and of colours, both of which follow from the position (`egg`).
constexpr const char* kReport = R"(
import os, sys
import bpy, numpy
numpy.bool = bool  # the glTF reader of Blender 3.4 wants the name that NumPy 1.24 dropped
for path in sys.argv[sys.argv.index('--') + 1:]:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    to_y_up = lambda p: (p[0], p[1], p[2])
    if path.endswith('.obj'):
        bpy.ops.wm.obj_import(filepath=path)
    elif path.endswith('.ply'):
        bpy.ops.import_mesh.ply(filepath=path)
    else:
        bpy.ops.import_scene.gltf(filepath=path)
        to_y_up = lambda p: (p[0], p[2], -p[1])
    mesh = [o for o in bpy.context.scene.objects if o.type == 'MESH'][0].data
    mesh.calc_loop_triangles()
    places = [to_y_up(v.co) for v in mesh.vertices]
    low = [min(p[a] for p in places) for a in range(3)]
    high = [max(p[a] for p in places) for a in range(3)]
    uv_error = color_error = 0.0
    colors = mesh.color_attributes[0]
    for loop in mesh.loops:
        p = places[loop.vertex_index]
        told = (p[0] + 0.5, 0.5 * p[1] + 0.5)
        uv = mesh.uv_layers[0].data[loop.index].uv
        uv_error = max(uv_error, abs(uv[0] - told[0]), abs(uv[1] - told[1]))
        row = loop.index if colors.domain == 'CORNER' else loop.vertex_index
        c = colors.data[row].color
        color_error = max(color_error, abs(c[0] - told[0]), abs(c[1] - told[1]), abs(c[2] - 0.5))
    print('judged', os.path.basename(path), len(mesh.vertices), len(mesh.loop_triangles), *low,
          *high, uv_error, color_error)
)";

/// An ellipsoid whose texture coordinates and colours follow from the position.
Mesh egg() {
  Mesh mesh = fixtures::sphere(2);
  mesh.vertices.col(0) *= 0.5;
  mesh.vertices.col(2) *= 0.25;
  mesh.uvs.resize(mesh.vertices.rows(), 2);
  mesh.uvs.col(0) = mesh.vertices.col(0).array() + 0.5;
  mesh.uvs.col(1) = 0.5 * mesh.vertices.col(1).array() + 0.5;
  mesh.uv_faces = mesh.faces;
  mesh.colors = Colors::Constant(mesh.vertices.rows(), 3, 0.5F);
  mesh.colors.leftCols(2) = mesh.uvs.cast<float>();
  return mesh;
}

TEST(Blender, ObjPlyAndGlb_ImportInBlenderUnchanged) {
  const fixtures::TemporaryDirectory folder;
  if (fixtures::run_child({"sh", "-c", "command -v blender"}).exit_code != 0) {
    GTEST_SKIP() << "no program blender (scripts/setup --judges)";
  }
  const Mesh mesh = egg();
  write_obj(folder / "egg.obj", mesh);
  write_ply(folder / "text.ply", mesh, {.format = PlyFormat::Ascii});
  write_ply(folder / "little.ply", mesh);
  write_ply(folder / "big.ply", mesh, {.format = PlyFormat::BinaryBigEndian});
  write_gltf(folder / "egg.glb", gltf_scene(mesh));
  std::ofstream(folder / "report.py") << kReport;
  std::vector<std::string> command = {"blender",
                                      "-b",
                                      "--factory-startup",
                                      "--python-exit-code",
                                      "3",
                                      "--python",
                                      (folder / "report.py").string(),
                                      "--"};
  const std::vector<std::string> names = {"egg.obj", "text.ply", "little.ply", "big.ply",
                                          "egg.glb"};
  for (const std::string& name : names) {
    command.push_back((folder / name).string());
  }
  const fixtures::ChildResult result = fixtures::run_child(command);
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;

  std::map<std::string, std::vector<double>> judged;
  std::istringstream lines(result.out);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string word;
    std::string name;
    if (words >> word && word == "judged" && words >> name) {
      for (double number = 0; words >> number;) {
        judged[name].push_back(number);
      }
    }
  }
  for (const std::string& name : names) {
    SCOPED_TRACE(name);
    const std::vector<double>& found = judged[name];
    ASSERT_EQ(found.size(), 10U) << result.out << result.err;
    EXPECT_EQ(found[0], 66);
    EXPECT_EQ(found[1], 128);
    const double corners[] = {-0.5, -1, -0.25, 0.5, 1, 0.25};
    for (std::size_t i = 0; i < 6; ++i) {
      EXPECT_NEAR(found[2 + i], corners[i], 1e-6);
    }
    EXPECT_LT(found[8], 1e-6) << "texture coordinates";
    EXPECT_LT(found[9], 0.006) << "colours";  // half a byte of sRGB at its steepest
  }
}

}  // namespace
}  // namespace atelier
