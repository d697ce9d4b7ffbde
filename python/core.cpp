#include "core/camera.h"
#include "core/device.h"
#include "core/finding.h"
#include "core/garment.h"
#include "core/mesh.h"
#include "core/normals.h"
#include "core/parallel.h"
#include "core/pose.h"
#include "core/sequence.h"
#include "core/skeleton.h"
#include "core/topology.h"
#include "core/tree.h"
#include "python/arrays.h"
#include "python/bindings.h"
#include "python/checks.h"
#include "python/device.h"
#include "python/options.h"
#include "python/signals.h"

namespace atelier::python {
namespace {

using namespace py::literals;

void bind_mesh(py::module_& module) {
  py::class_<Mesh> mesh(
      module, "Mesh",
      "A triangle mesh in metres, Y up. Attributes are empty or have the rows stated.");
  mesh.def(py::init([](Points vertices, Triangles faces, Points2 uvs, Triangles uv_faces,
                       Colors colors) {
             Mesh made;
             made.vertices = std::move(vertices);
             made.faces = std::move(faces);
             made.uvs = std::move(uvs);
             made.uv_faces = std::move(uv_faces);
             made.colors = std::move(colors);
             return made;
           }),
           "vertices"_a = py::none(), "faces"_a = py::none(), "uvs"_a = py::none(),
           "uv_faces"_a = py::none(), "colors"_a = py::none());
  array_field<&Mesh::vertices>(mesh, "vertices", "[V,3] metres");
  array_field<&Mesh::faces>(mesh, "faces", "[F,3] into vertices, counter-clockwise from outside");
  array_field<&Mesh::normals>(mesh, "normals", "[V,3] unit length, or empty");
  array_field<&Mesh::colors>(mesh, "colors", "[V,3] linear RGB in [0,1], or empty");
  array_field<&Mesh::uvs>(mesh, "uvs", "[T,2] texture coordinates, v up, or empty");
  array_field<&Mesh::uv_faces>(mesh, "uv_faces", "[F,3] into uvs, or empty");
  array_field<&Mesh::labels>(mesh, "labels", "[V] ids of the label taxonomy, or empty");
  array_field<&Mesh::confidence>(mesh, "confidence", "[V] in [0,1], or empty");
  mesh.def("__repr__", [](const Mesh& self) {
    return "<Mesh of " + std::to_string(self.vertices.rows()) + " vertices, " +
           std::to_string(self.faces.rows()) + " faces>";
  });
  mesh.def("__copy__", [](const Mesh& self) { return Mesh(self); });
  mesh.def("__deepcopy__", [](const Mesh& self, const py::dict&) { return Mesh(self); });
  module.def("check_mesh", &check_mesh, "mesh"_a, "file"_a = "",
             "Raises DataError unless rows agree, indices are in range and numbers finite.");
  module.def(
      "vertex_normals",
      [](PointsView vertices, const Triangles& faces) {
        require_faces(faces, vertices.rows());
        return vertex_normals(vertices, faces);
      },
      "vertices"_a, "faces"_a, py::call_guard<LongCall>(),
      "[V,3] of unit length, weighted by the angles of the faces. Raises DataError for a face of a "
      "vertex that is not there.");
  module.def(
      "edges_of",
      [](const Triangles& faces, Index vertex_count) {
        return topology_of(faces, vertex_count).edges;
      },
      "faces"_a, "vertex_count"_a, py::call_guard<LongCall>(),
      "[E,2] edges of a mesh, the smaller vertex first, in lexicographic order.");
}

void bind_camera(py::module_& module) {
  py::class_<Camera> camera(
      module, "Camera",
      "A calibrated camera: x right, y down, z forward; pixels, the first one's "
      "centre at (0.5, 0.5); metres.");
  camera.def(py::init<>());
  camera.def_readwrite("id", &Camera::id);
  camera.def_readwrite("width", &Camera::width, "pixels");
  camera.def_readwrite("height", &Camera::height, "pixels");
  camera.def_readwrite("fx", &Camera::fx, "pixels");
  camera.def_readwrite("fy", &Camera::fy, "pixels");
  camera.def_readwrite("cx", &Camera::cx, "pixels");
  camera.def_readwrite("cy", &Camera::cy, "pixels");
  camera.def_property(
      "distortion_model",
      [](const Camera& self) -> std::string {
        return self.distortion_model == Distortion::None    ? "none"
               : self.distortion_model == Distortion::Brown ? "brown"
                                                            : "fisheye";
      },
      [](Camera& self, const std::string& name) {
        if (name != "none" && name != "brown" && name != "fisheye") {
          throw DataError("", "distortion_model", "'" + name + "'", "none, brown or fisheye");
        }
        self.distortion_model = name == "none"    ? Distortion::None
                                : name == "brown" ? Distortion::Brown
                                                  : Distortion::Fisheye;
      },
      "\"none\", \"brown\" (k1 k2 p1 p2 k3 k4 k5 k6) or \"fisheye\" (k1 k2 k3 k4)");
  camera.def_property(
      "distortion",
      [](const Camera& self) -> std::vector<double> {
        return {self.distortion.begin(), self.distortion.end()};
      },
      [](Camera& self, const Eigen::Matrix<double, 8, 1>& values) {
        std::copy(values.data(), values.data() + 8, self.distortion.begin());
      },
      "[8]");
  array_field<&Camera::camera_from_world_rotation>(camera, "camera_from_world_rotation", "[3,3]");
  array_field<&Camera::camera_from_world_translation>(camera, "camera_from_world_translation",
                                                      "[3] metres");
  array_field<&Camera::gain>(camera, "gain", "[3] factors on linear RGB");
  camera.def("__repr__", [](const Camera& self) {
    return "<Camera '" + self.id + "', " + std::to_string(self.width) + " x " +
           std::to_string(self.height) + ">";
  });
  module.def("camera_center", &camera_center, "camera"_a, "Where it stands, metres in the world.");
  module.def(
      "check_camera", &check_camera, "camera"_a, "file"_a = "",
      "Raises DataError unless the image size and focal lengths are positive, the rotation [3,3] "
      "is one, and all numbers are finite; `file` is what the error names.");
  module.def(
      "project",
      [](const Camera& with, PointsView points) {
        Points2 pixels(points.rows(), 2);
        for (Index i = 0; i < points.rows(); ++i) {
          const auto pixel = project(with, Eigen::Vector3d(points.row(i)));
          pixels.row(i) =
              pixel ? *pixel : Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
        }
        return pixels;
      },
      "camera"_a, "points"_a, py::call_guard<py::gil_scoped_release>(),
      "Pixels [N,2] of world points [N,3]; NaN behind the camera and where the distortion folds "
      "over.");
}

void bind_pose(py::module_& module) {
  py::class_<Skeleton> skeleton(
      module, "Skeleton",
      "A tree of joints; parents come before their children, joint 0 is the root.");
  skeleton.def(py::init<>());
  skeleton.def_readwrite("names", &Skeleton::names);
  array_field<&Skeleton::parents>(skeleton, "parents", "[J]; of the root -1");
  array_field<&Skeleton::offsets>(skeleton, "offsets", "[J,3] metres from the parent's joint");
  array_field<&Skeleton::rest_rotations>(skeleton, "rest_rotations",
                                         "[J,3] rotation vectors, or empty: identity");
  skeleton.def("__len__", [](const Skeleton& self) { return self.names.size(); });
  module.def(
      "find_joint",
      [](const Skeleton& of, const std::string& name) {
        const int joint = find_joint(of, name);
        if (joint < 0) {
          std::string names;
          for (const std::string& one : of.names) {
            names += (names.empty() ? "" : ", ") + one;
          }
          throw DataError("", "joint", "'" + name + "', which the skeleton has not",
                          "one of " + names);
        }
        return joint;
      },
      "skeleton"_a, "name"_a, "Index of a joint. Raises DataError if there is none.");

  py::class_<Pose> pose(module, "Pose", "One pose of a skeleton.");
  pose.def(py::init([](Points rotations, const Eigen::Vector3d& translation) {
             return Pose{translation, std::move(rotations)};
           }),
           "rotations"_a = py::none(), "root_translation"_a = std::vector<double>{0, 0, 0});
  array_field<&Pose::rotations>(pose, "rotations",
                                "[J,3] rotation vectors (radians) relative to the parent");
  array_field<&Pose::root_translation>(pose, "root_translation",
                                       "[3] metres, added to the root's offset");

  py::class_<Motion> motion(module, "Motion", "Poses over time.");
  motion.def(py::init([](std::vector<Pose> poses, double fps, std::vector<int> frame_ids) {
               return Motion{fps, std::move(frame_ids), std::move(poses)};
             }),
             "poses"_a, "fps"_a, "frame_ids"_a);
  motion.def_readwrite("fps", &Motion::fps, "frames per second");
  array_field<&Motion::frame_ids>(motion, "frame_ids", "[N], increasing");
  motion.def("__len__", [](const Motion& self) { return self.poses.size(); });
  motion.def(
      "__getitem__",
      [](Motion& self, py::ssize_t at) -> Pose& {
        const auto count = static_cast<py::ssize_t>(self.poses.size());
        if (at < -count || at >= count) {
          throw py::index_error("frame " + std::to_string(at) + " of " + std::to_string(count));
        }
        return self.poses[static_cast<std::size_t>(at < 0 ? at + count : at)];
      },
      py::return_value_policy::reference_internal, "index"_a);
  motion.def(
      "rotations",
      [](const Motion& self) {
        const auto count = static_cast<Index>(self.poses.size());
        const Index joints = count == 0 ? 0 : self.poses.front().rotations.rows();
        std::vector<double> numbers;
        numbers.reserve(static_cast<std::size_t>(count * joints * 3));
        for (const Pose& one : self.poses) {
          numbers.insert(numbers.end(), one.rotations.data(),
                         one.rotations.data() + one.rotations.size());
        }
        return array_of(std::move(numbers)).reshape({count, joints, Index{3}});
      },
      "[N,J,3] of all frames, copied.");
}

void bind_garment(py::module_& module) {
  py::class_<Material> material(module, "Material",
                                "Physical properties of a fabric; moduli of the membrane.");
  material.def(py::init<>());
  material.def(py::init([](const py::kwargs& values) {
    Material made;
    py::dict others;
    for (const auto& [key, value] : values) {
      if (py::str(key).cast<std::string>() == "name") {
        made.name = value.cast<std::string>();
      } else {
        others[key] = value;
      }
    }
    set_options(describe(made), others);
    return made;
  }));
  material.def_readwrite("name", &Material::name);
  material.def_readwrite("density", &Material::density, "kg/m2");
  material.def_readwrite("stretch_warp", &Material::stretch_warp, "N/m, along the grain");
  material.def_readwrite("stretch_weft", &Material::stretch_weft, "N/m, across the grain");
  material.def_readwrite("shear", &Material::shear, "N/m");
  material.def_readwrite("bending", &Material::bending, "N m");
  material.def_readwrite("damping", &Material::damping, "s");
  material.def_readwrite("friction", &Material::friction, "Coulomb coefficient");
  material.def_readwrite("thickness", &Material::thickness, "m");
  material.def("to_dict", [](Material& self) { return options_dict(describe(self)); });
  material.def("__repr__", [](Material& self) {
    std::string text = "Material(name='" + self.name + "'";
    const OptionTable table = describe(self);
    for (const OptionField& field : table.fields) {
      text += ", " + field.name + "=" + option_text(field);
    }
    return text + ")";
  });

  py::class_<Seam> seam(module, "Seam", "Two runs of vertices that are sewn together.");
  seam.def(py::init([](std::string name, std::vector<int> a, std::vector<int> b) {
             return Seam{std::move(name), std::move(a), std::move(b)};
           }),
           "name"_a, "a"_a, "b"_a);
  seam.def_readwrite("name", &Seam::name);
  array_field<&Seam::a>(seam, "a", "vertices of one side, in order");
  array_field<&Seam::b>(seam, "b", "b[i] is sewn to a[i]");

  py::class_<Attachment> attachment(module, "Attachment",
                                    "A garment's vertex that moves with a triangle of the body.");
  attachment.def(
      py::init([](int vertex, int triangle, const Eigen::Vector3d& barycentric, double distance) {
        return Attachment{vertex, triangle, barycentric, distance};
      }),
      "vertex"_a, "triangle"_a, "barycentric"_a, "distance"_a = 0.0);
  attachment.def_readwrite("vertex", &Attachment::vertex);
  attachment.def_readwrite("triangle", &Attachment::triangle);
  array_field<&Attachment::barycentric>(attachment, "barycentric", "[3], sums to 1");
  attachment.def_readwrite("distance", &Attachment::distance, "metres along the normal");

  py::class_<Garment> garment(module, "Garment",
                              "A template in 3D with its flat rest shape, seams and material.");
  garment.def(py::init([](std::string name, Mesh mesh, Material fabric) {
                Garment made;
                made.name = std::move(name);
                made.mesh = std::move(mesh);
                made.material = std::move(fabric);
                return made;
              }),
              "name"_a = "", "mesh"_a = Mesh{}, "material"_a = Material{});
  garment.def_readwrite("name", &Garment::name);
  struct_field<&Garment::mesh>(garment, "mesh", "the template; uvs are the texture atlas");
  array_field<&Garment::rest>(garment, "rest", "[R,2] metres, flat panels, or empty");
  array_field<&Garment::rest_faces>(garment, "rest_faces", "[F,3] into rest, or empty");
  array_field<&Garment::panels>(garment, "panels", "[F] panel of each face, or empty");
  garment.def_readwrite("panel_names", &Garment::panel_names);
  list_field<&Garment::seams>(garment, "seams");
  garment.def_readwrite("boundaries", &Garment::boundaries, "closed loops of vertices; a copy");
  garment.def_readwrite("boundary_names", &Garment::boundary_names);
  list_field<&Garment::attachments>(garment, "attachments");
  struct_field<&Garment::material>(garment, "material");
  garment.def("__repr__", [](const Garment& self) {
    return "<Garment '" + self.name + "', " + std::to_string(self.mesh.vertices.rows()) +
           " vertices>";
  });
  module.def(
      "check_garment", &check_garment, "garment"_a, "file"_a = "",
      "Raises DataError unless rest shape, seams and materials fit the mesh; `file` is what the "
      "error names.");
}

void bind_sequence(py::module_& module) {
  py::class_<Sequence> sequence(
      module, "Sequence", "Meshes over time, read when asked for: len(s), s[i], s.frame_ids.");
  sequence.def_readonly("fps", &Sequence::fps, "frames per second");
  array_field<&Sequence::frame_ids>(sequence, "frame_ids", "[N], the capture's own numbers");
  array_field<&Sequence::faces>(sequence, "faces", "[F,3] of every frame; empty if frames differ");
  sequence.def("__len__", &frame_count);
  sequence.def(
      "__getitem__",
      [](const Sequence& self, Index at) {
        const Index count = frame_count(self);
        if (at < -count || at >= count) {
          throw py::index_error("frame " + std::to_string(at) + " of " + std::to_string(count));
        }
        const py::gil_scoped_release released;
        return frame(self, at < 0 ? at + count : at);
      },
      "index"_a);
  module.def("sequence_of", &sequence_of, "meshes"_a, "fps"_a, "frame_ids"_a = py::none(),
             "A sequence that holds its meshes.");
}

/// One member of every element of a vector of structs, as an array over the vector's memory.
template <class Struct, class Number>
py::array strided(const std::vector<Struct>& all, const Number* first, py::ssize_t columns,
                  py::handle owner) {
  const std::vector<py::ssize_t> shape =
      columns == 1 ? std::vector<py::ssize_t>{static_cast<py::ssize_t>(all.size())}
                   : std::vector<py::ssize_t>{static_cast<py::ssize_t>(all.size()), columns};
  const std::vector<py::ssize_t> strides =
      columns == 1 ? std::vector<py::ssize_t>{sizeof(Struct)}
                   : std::vector<py::ssize_t>{sizeof(Struct), sizeof(Number)};
  return py::array(py::dtype::of<Number>(), shape, strides, all.empty() ? nullptr : first, owner);
}

using ClosestPoints = std::vector<ClosestPoint>;
struct ClosestPointArrays {
  ClosestPoints all;
};
struct RayHitArrays {
  std::vector<RayHit> all;
};

void bind_tree(py::module_& module) {
  py::class_<TriangleTree>(module, "TriangleTree",
                           "A tree of boxes over triangles: build_tree, refit_tree.");
  py::class_<ClosestPointArrays>(module, "ClosestPoints", "Nearest points of Q queries.")
      .def_property_readonly(
          "face",
          [](py::object self) {
            const auto& all = self.cast<ClosestPointArrays&>().all;
            return strided(all, all.empty() ? nullptr : &all.front().face, 1, self);
          },
          "[Q]; -1: nothing within the distance asked for")
      .def_property_readonly(
          "point",
          [](py::object self) {
            const auto& all = self.cast<ClosestPointArrays&>().all;
            return strided(all, all.empty() ? nullptr : all.front().point.data(), 3, self);
          },
          "[Q,3] metres")
      .def_property_readonly(
          "barycentric",
          [](py::object self) {
            const auto& all = self.cast<ClosestPointArrays&>().all;
            return strided(all, all.empty() ? nullptr : all.front().barycentric.data(), 3, self);
          },
          "[Q,3] of the face's corners")
      .def_property_readonly(
          "squared_distance",
          [](py::object self) {
            const auto& all = self.cast<ClosestPointArrays&>().all;
            return strided(all, all.empty() ? nullptr : &all.front().squared_distance, 1, self);
          },
          "[Q] square metres")
      .def("__len__", [](const ClosestPointArrays& self) { return self.all.size(); });
  py::class_<RayHitArrays>(module, "RayHits", "First hits of R rays.")
      .def_property_readonly(
          "face",
          [](py::object self) {
            const auto& all = self.cast<RayHitArrays&>().all;
            return strided(all, all.empty() ? nullptr : &all.front().face, 1, self);
          },
          "[R]; -1: nothing")
      .def_property_readonly(
          "t",
          [](py::object self) {
            const auto& all = self.cast<RayHitArrays&>().all;
            return strided(all, all.empty() ? nullptr : &all.front().t, 1, self);
          },
          "[R] in units of the direction")
      .def_property_readonly(
          "barycentric",
          [](py::object self) {
            const auto& all = self.cast<RayHitArrays&>().all;
            return strided(all, all.empty() ? nullptr : all.front().barycentric.data(), 3, self);
          },
          "[R,3]")
      .def("__len__", [](const RayHitArrays& self) { return self.all.size(); });
  module.def(
      "build_tree",
      [](const Points& vertices, const Triangles& faces, int leaf_size) {
        require_faces(faces, vertices.rows());
        if (leaf_size < 1) {
          throw DataError("", "leaf_size", std::to_string(leaf_size), "1 face or more");
        }
        return build_tree(vertices, faces, {.leaf_size = leaf_size});
      },
      "vertices"_a, "faces"_a, "leaf_size"_a = 4, py::call_guard<LongCall>(),
      "Tree over the faces of a mesh.");
  module.def(
      "refit_tree",
      [](const TriangleTree& tree, PointsView vertices) { return refit_tree(tree, vertices); },
      "tree"_a, "vertices"_a, py::call_guard<LongCall>(), "The same tree over moved vertices.");
  module.def(
      "closest_points",
      [](const TriangleTree& tree, PointsView queries, double max_distance,
         const std::string& device) {
        if (!(max_distance >= 0)) {
          throw DataError("", "max_distance", std::to_string(max_distance), "0 m or more");
        }
        return ClosestPointArrays{closest_points(tree, queries, max_distance, device_of(device))};
      },
      "tree"_a, "queries"_a, "max_distance"_a = std::numeric_limits<double>::infinity(),
      "device"_a = "cpu", py::call_guard<LongCall>(),
      "Nearest point of the surface for every row of `queries` [Q,3], within `max_distance` "
      "metres.");
  module.def(
      "first_hits",
      [](const TriangleTree& tree, PointsView origins, PointsView directions,
         const std::string& device) {
        if (origins.rows() != directions.rows()) {
          throw DataError("", "directions", std::to_string(directions.rows()) + " rows",
                          std::to_string(origins.rows()) + ", as of origins");
        }
        std::vector<Ray> rays(static_cast<std::size_t>(origins.rows()));
        for (std::size_t i = 0; i < rays.size(); ++i) {
          rays[i].origin = origins.row(static_cast<Index>(i));
          rays[i].direction = directions.row(static_cast<Index>(i));
          if (rays[i].direction.isZero(0)) {
            throw DataError("", "directions, row " + std::to_string(i), "0, 0, 0", "a direction");
          }
        }
        return RayHitArrays{first_hits(tree, rays, device_of(device))};
      },
      "tree"_a, "origins"_a, "directions"_a, "device"_a = "cpu", py::call_guard<LongCall>(),
      "First hit of every ray [R,3], from either side.");
}

void bind_finding(py::module_& module) {
  py::class_<Finding>(module, "Finding", "One thing that a check found.")
      .def_property_readonly(
          "severity",
          [](const Finding& self) -> std::string { return severity_name(self.severity); })
      .def_readonly("code", &Finding::code)
      .def_readonly("place", &Finding::place)
      .def_readonly("what", &Finding::what)
      .def_readonly("advice", &Finding::advice)
      .def_readonly("setting", &Finding::setting)
      .def("__repr__", [](const Finding& self) { return to_string(self); });
}

}  // namespace

Device device_of(const std::string& name) {
  if (name != "cpu" && name != "cuda") {
    throw DataError("", "device", "'" + name + "'", "cpu or cuda");
  }
  return name == "cuda" ? Device::Cuda : Device::Cpu;
}

void bind_core(py::module_& module) {
  bind_finding(module);
  bind_mesh(module);
  bind_camera(module);
  bind_pose(module);
  bind_garment(module);
  bind_sequence(module);
  bind_tree(module);
  module.def("cuda_available", &cuda_available,
             "True if a device answers and this build has CUDA.");
  module.def("set_thread_count", &set_thread_count, "count"_a,
             "Threads that loops use from now on; 0: as many as the machine has.");
  module.def("thread_count", &thread_count, "Threads that loops use.");
}

}  // namespace atelier::python
