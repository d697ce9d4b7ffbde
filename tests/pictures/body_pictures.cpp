// Makes the images of docs/methods/default_human.md: body_pictures FOLDER.
#include <Eigen/Geometry>
#include <array>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "bodymodel/human/default_human.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/rotation.h"
#include "bodymodel/skinning.h"
#include "core/io/image_file.h"
#include "core/render/contact_sheet.h"
#include "core/render/scaled_pictures.h"

namespace atelier {
namespace {

using Turns = std::vector<Eigen::Vector3d>;  // applied last to first

void turn(const Skeleton& skeleton, Pose& pose, const std::string& joint, const Turns& turns) {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  for (const Eigen::Vector3d& one : turns) {
    rotation = rotation * rotation_matrix(one);
  }
  pose.rotations.row(find_joint(skeleton, joint)) = rotation_vector(rotation).transpose();
}

// Turns of the left side are mirrored to the right.
void turn_side(const Skeleton& skeleton, Pose& pose, int side, const std::string& joint,
               Turns turns) {
  for (Eigen::Vector3d& one : turns) {
    one = side == 0 ? one : Eigen::Vector3d(one.x(), -one.y(), -one.z());
  }
  turn(skeleton, pose, (side == 0 ? "left_" : "right_") + joint, turns);
}

constexpr double kFlexion = 0.70710678;  // of the elbow, forward: about (-1, -1, 0)

Turns flexed(double angle) {
  return {{-kFlexion * angle, -kFlexion * angle, 0}};
}

using MakePose = std::function<void(const Skeleton&, Pose&)>;

void hands(const Skeleton& skeleton, Pose& pose, double curl) {
  for (int side = 0; side < 2; ++side) {
    for (const char* finger : {"index", "middle", "ring", "pinky"}) {
      for (const char* knuckle : {"1", "2", "3"}) {
        // Fingers bend towards the palm, about the thumb's side (+z): the palm faces (-1, -1, 0).
        turn_side(skeleton, pose, side, std::string(finger) + knuckle, {{0, 0, -curl}});
      }
    }
  }
}

void relaxed_arms(const Skeleton& skeleton, Pose& pose, double swing) {
  for (int side = 0; side < 2; ++side) {
    const double s = side == 0 ? swing : -swing;
    turn_side(skeleton, pose, side, "shoulder", {{s, 0, 0}, {0, 0, -0.62}});
    turn_side(skeleton, pose, side, "elbow", flexed(0.35));
  }
  hands(skeleton, pose, 0.15);
}

void walking(const Skeleton& skeleton, Pose& pose) {
  relaxed_arms(skeleton, pose, 0.4);
  turn(skeleton, pose, "pelvis", {{0.03, -0.1, 0}});
  turn(skeleton, pose, "spine2", {{0, 0.16, 0}});
  turn(skeleton, pose, "left_hip", {{-0.48, 0, 0}});
  turn(skeleton, pose, "left_knee", {{0.1, 0, 0}});
  turn(skeleton, pose, "left_ankle", {{0.2, 0, 0}});
  turn(skeleton, pose, "right_hip", {{0.28, 0, 0}});
  turn(skeleton, pose, "right_knee", {{0.42, 0, 0}});
  turn(skeleton, pose, "right_ankle", {{0.12, 0, 0}});
  turn(skeleton, pose, "right_foot", {{-0.45, 0, 0}});
}

void sitting(const Skeleton& skeleton, Pose& pose) {
  turn(skeleton, pose, "spine1", {{0.06, 0, 0}});
  for (int side = 0; side < 2; ++side) {
    turn_side(skeleton, pose, side, "hip", {{0, 0, 0.1}, {-1.5, 0, 0}});
    turn_side(skeleton, pose, side, "knee", {{1.5, 0, 0}});
    turn_side(skeleton, pose, side, "shoulder", {{-0.35, 0, 0}, {0, 0, -0.62}});
    turn_side(skeleton, pose, side, "elbow", flexed(1.0));
  }
  hands(skeleton, pose, 0.15);
}

void arms_up(const Skeleton& skeleton, Pose& pose) {
  for (int side = 0; side < 2; ++side) {
    turn_side(skeleton, pose, side, "collar", {{0, 0, 0.35}});
    turn_side(skeleton, pose, side, "shoulder", {{0, 0, 1.75}});
  }
}

void lunge(const Skeleton& skeleton, Pose& pose) {
  turn(skeleton, pose, "left_hip", {{-1.25, 0, 0}});
  turn(skeleton, pose, "left_knee", {{1.35, 0, 0}});
  turn(skeleton, pose, "left_ankle", {{-0.1, 0, 0}});
  turn(skeleton, pose, "right_hip", {{0.42, 0, 0}});
  turn(skeleton, pose, "right_knee", {{0.62, 0, 0}});
  turn(skeleton, pose, "right_ankle", {{-0.33, 0, 0}});
  turn(skeleton, pose, "right_foot", {{-1.04, 0, 0}});
  relaxed_arms(skeleton, pose, 0.35);
}

void guard(const Skeleton& skeleton, Pose& pose) {
  turn(skeleton, pose, "pelvis", {{0, -0.35, 0}});
  turn(skeleton, pose, "spine2", {{0.12, 0.2, 0}});
  turn(skeleton, pose, "left_hip", {{-0.35, 0, 0.06}});
  turn(skeleton, pose, "left_knee", {{0.45, 0, 0}});
  turn(skeleton, pose, "left_ankle", {{-0.1, 0, 0}});
  turn(skeleton, pose, "right_hip", {{0.05, 0, -0.1}});
  turn(skeleton, pose, "right_knee", {{0.42, 0, 0}});
  turn(skeleton, pose, "right_ankle", {{-0.4, 0, 0}});
  for (int side = 0; side < 2; ++side) {
    turn_side(skeleton, pose, side, "shoulder", {{-0.55, 0, 0}, {0, 0, -0.5}});
    turn_side(skeleton, pose, side, "elbow", flexed(2.05));
  }
  hands(skeleton, pose, 1.2);
}

void reaching(const Skeleton& skeleton, Pose& pose) {
  relaxed_arms(skeleton, pose, 0);
  turn(skeleton, pose, "spine1", {{0.1, 0.1, 0}});
  turn(skeleton, pose, "spine3", {{0.05, 0.2, 0}});
  turn(skeleton, pose, "right_collar", {{0, 0.15, -0.1}});
  turn(skeleton, pose, "right_shoulder", {{0, 1.35, 0}, {0, 0, -0.75}});
  turn(skeleton, pose, "right_elbow", {{0, 0.15, 0}});
  turn(skeleton, pose, "right_hip", {{-0.22, 0, 0}});
  turn(skeleton, pose, "right_knee", {{0.22, 0, 0}});
  turn(skeleton, pose, "left_hip", {{0.1, 0, 0}});
  turn(skeleton, pose, "left_knee", {{0.06, 0, 0}});
  turn(skeleton, pose, "left_ankle", {{-0.16, 0, 0}});
}

Mesh skin(const BodyModel& model, const Points& vertices) {
  Mesh mesh;
  mesh.vertices = vertices;
  mesh.faces = model.mesh.faces;
  return mesh;
}

// Bends a leg until both feet are on the ground, where some bend of its knee does that.
void stand(const BodyModel& model, Pose& pose, const std::string& knee) {
  const int joint = find_joint(model.skeleton, knee);
  const double side = knee.starts_with("left") ? 1 : -1;
  // How much higher the foot of that leg is than the other.
  const auto gap = [&](double bend) {
    pose.rotations(joint, 0) = bend;
    const Points posed = skin_vertices(model, pose);
    double low[2] = {10, 10};
    for (Index v = 0; v < posed.rows(); ++v) {
      if (model.mesh.vertices(v, 1) < 0.15) {
        double& lowest = low[side * model.mesh.vertices(v, 0) > 0 ? 0 : 1];
        lowest = std::min(lowest, posed(v, 1));
      }
    }
    return low[0] - low[1];
  };
  const double before = pose.rotations(joint, 0);
  double a = 0.02;
  double b = 1.6;
  if (gap(a) > 0 || gap(b) < 0) {
    gap(before);
    return;
  }
  for (int i = 0; i < 20; ++i) {
    const double c = (a + b) / 2;
    (gap(c) < 0 ? a : b) = c;
  }
}

// A block to sit on, whose top is at the lowest point of the seat.
Mesh block(double x, double top, double bottom, double back, double front) {
  Points corners(8, 3);
  corners << -x, bottom, back, x, bottom, back, x, bottom, front, -x, bottom, front,  //
      -x, top, back, x, top, back, x, top, front, -x, top, front;
  const int faces[12][3] = {{0, 1, 2}, {0, 2, 3}, {4, 6, 5}, {4, 7, 6}, {0, 5, 1}, {0, 4, 5},
                            {2, 6, 7}, {2, 7, 3}, {0, 3, 7}, {0, 7, 4}, {1, 5, 6}, {1, 6, 2}};
  Mesh mesh;  // corners of its own for every triangle: sharp edges
  mesh.vertices.resize(36, 3);
  mesh.faces.resize(12, 3);
  for (int f = 0; f < 12; ++f) {
    for (int c = 0; c < 3; ++c) {
      mesh.vertices.row(3 * f + c) = corners.row(faces[f][c]);
      mesh.faces(f, c) = 3 * f + c;
    }
  }
  return mesh;
}

PictureOptions tile(int width, int height) {
  PictureOptions options;
  options.width = width;
  options.height = height;
  options.samples = 16;
  options.framing.margin = 0.03;
  return options;
}

void save(const std::filesystem::path& path, const std::vector<CaptionedImage>& tiles,
          int columns) {
  ContactSheetOptions sheet;
  sheet.columns = columns;
  sheet.gap = 6;
  write_image(path, contact_sheet(tiles, sheet));
  std::printf("%s\n", path.c_str());
}

DefaultHumanOptions body(double male, double stature, double mass) {
  DefaultHumanOptions options;
  options.male = male;
  options.stature = stature;
  options.mass = mass;
  options.shape_basis = false;
  return options;
}

void shapes(const std::filesystem::path& folder) {
  DefaultHumanOptions athletic = body(1, 1.86, 84);
  athletic.waist_girth = 0.84;
  athletic.chest_girth = 1.06;
  athletic.upper_arm_girth = 0.345;
  athletic.shoulder_breadth = 0.45;
  const std::pair<const char*, DefaultHumanOptions> bodies[] = {
      {"woman, average", body(0, 0, 0)},           {"man, average", body(1, 0, 0)},
      {"woman, 1.76 m, 61 kg", body(0, 1.76, 61)}, {"woman, 1.60 m, 84 kg", body(0, 1.6, 84)},
      {"man, 1.86 m, athletic", athletic},         {"man, 1.68 m, 98 kg", body(1, 1.68, 98)}};
  std::vector<CaptionedImage> tiles;
  std::vector<Mesh> meshes;
  for (const auto& [name, options] : bodies) {
    const BodyModel model = default_human(options);
    meshes.push_back(skin(model, model.mesh.vertices));
  }
  for (const View& view : {View{0.35, 0.1}, View{2.75, 0.1}}) {
    const std::vector<Image> pictures = pictures_at_one_scale(meshes, view, tile(350, 430));
    for (std::size_t i = 0; i < pictures.size(); ++i) {
      tiles.push_back({pictures[i], view.azimuth < 1 ? bodies[i].first : ""});
    }
  }
  save(folder / "default_human_shapes.jpg", tiles, 6);
}

void poses(const std::filesystem::path& folder) {
  const MakePose t_pose = [](const Skeleton& skeleton, Pose& pose) {
    for (int side = 0; side < 2; ++side) {
      turn_side(skeleton, pose, side, "shoulder", {{0, 0, 0.7854}});
    }
  };
  const std::pair<const char*, MakePose> list[] = {{"A-pose", [](const Skeleton&, Pose&) {}},
                                                   {"T-pose", t_pose},
                                                   {"walking", walking},
                                                   {"sitting", sitting},
                                                   {"arms up", arms_up},
                                                   {"lunge", lunge},
                                                   {"guard", guard},
                                                   {"reaching", reaching}};
  const BodyModel bodies[2] = {default_human(body(0, 0, 0)), default_human(body(1, 0, 0))};
  std::vector<CaptionedImage> tiles;
  std::vector<std::vector<RenderMesh>> subjects;
  int count = 0;
  for (const auto& [name, make] : list) {
    const BodyModel& model = bodies[count++ % 2];
    Pose pose = rest_pose(model.skeleton);
    make(model.skeleton, pose);
    const std::string bent = name == std::string("reaching") ? "left_knee" : "right_knee";
    if (name == std::string("walking") || name == std::string("lunge") ||
        name == std::string("guard") || name == std::string("reaching")) {
      stand(model, pose, bent);
    }
    const Points vertices = skin_vertices(model, pose);
    std::vector<RenderMesh> meshes = {{skin(model, vertices), clay_look()}};
    if (std::string(name) == "sitting") {
      const JointFrames frames = forward_kinematics(model.skeleton, pose);
      const double z = frames.positions(find_joint(model.skeleton, "left_hip"), 2);
      double seat = 10;
      for (Index v = 0; v < vertices.rows(); ++v) {
        if (vertices(v, 2) < z + 0.05) {
          seat = std::min(seat, vertices(v, 1));
        }
      }
      Look wood = clay_look();
      meshes.push_back(
          {block(0.24, seat + 0.006, vertices.col(1).minCoeff(), z - 0.22, z + 0.2), wood});
    }
    const double ground = vertices.col(1).minCoeff();
    for (RenderMesh& one : meshes) {
      one.mesh.vertices.col(1).array() -= ground;
    }
    subjects.push_back(std::move(meshes));
    tiles.push_back({{}, name});
  }
  const std::vector<Image> pictures =
      pictures_at_one_scale(std::move(subjects), View{0.6, 0.12}, tile(440, 520));
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    tiles[i].image = pictures[i];
  }
  save(folder / "default_human_poses.jpg", tiles, 4);
}

// What of a closed mesh is on the side of a plane that its normal points to, closed by a fan from
// the middle of the cut. Corners of the fan are its own, so that its edge is sharp.
Mesh cut(const Mesh& mesh, const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
  const Eigen::VectorXd height = (mesh.vertices.rowwise() - point.transpose()) * normal;
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<int, 3>> faces;
  std::vector<std::array<Eigen::Vector3d, 2>> edge;
  std::vector<int> kept(static_cast<std::size_t>(mesh.vertices.rows()), -1);
  std::map<std::pair<int, int>, int> crossing;
  const auto vertex = [&](int v) {
    int& at = kept[static_cast<std::size_t>(v)];
    if (at < 0) {
      at = static_cast<int>(points.size());
      points.emplace_back(mesh.vertices.row(v));
    }
    return at;
  };
  const auto between = [&](int a, int b) {
    const auto [it, fresh] =
        crossing.try_emplace({std::min(a, b), std::max(a, b)}, static_cast<int>(points.size()));
    if (fresh) {
      const double t = height[a] / (height[a] - height[b]);
      points.emplace_back(mesh.vertices.row(a) + t * (mesh.vertices.row(b) - mesh.vertices.row(a)));
    }
    return it->second;
  };
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    std::vector<int> corners;
    std::vector<int> border;
    for (int c = 0; c < 3; ++c) {
      const int v = mesh.faces(f, c);
      const int w = mesh.faces(f, (c + 1) % 3);
      if (height[v] >= 0) {
        corners.push_back(vertex(v));
      }
      if ((height[v] >= 0) != (height[w] >= 0)) {
        corners.push_back(between(v, w));
        border.push_back(corners.back());
      }
    }
    for (std::size_t i = 2; i < corners.size(); ++i) {
      faces.push_back({corners[0], corners[i - 1], corners[i]});
    }
    if (border.size() == 2) {
      edge.push_back({points[static_cast<std::size_t>(border[0])],
                      points[static_cast<std::size_t>(border[1])]});
    }
  }
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const auto& one : edge) {
    middle += 0.5 * (one[0] + one[1]) / static_cast<double>(edge.size());
  }
  for (const auto& one : edge) {
    const bool right = (one[0] - middle).cross(one[1] - middle).dot(normal) < 0;
    const int n = static_cast<int>(points.size());
    points.insert(points.end(), {one[right ? 0 : 1], one[right ? 1 : 0], middle});
    faces.push_back({n, n + 1, n + 2});
  }
  Mesh result;
  result.vertices.resize(static_cast<Index>(points.size()), 3);
  result.faces.resize(static_cast<Index>(faces.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) {
    result.vertices.row(static_cast<Index>(i)) = points[i];
  }
  for (std::size_t i = 0; i < faces.size(); ++i) {
    result.faces.row(static_cast<Index>(i)) << faces[i][0], faces[i][1], faces[i][2];
  }
  return result;
}

void details(const std::filesystem::path& folder) {
  std::vector<CaptionedImage> tiles;
  for (const double male : {0.0, 1.0}) {
    const BodyModel model = default_human(body(male, 0, 0));
    const Points joints = rest_positions(model.skeleton);
    const auto at = [&](const char* name) {
      return Eigen::Vector3d(joints.row(find_joint(model.skeleton, name)));
    };
    const Mesh all = skin(model, model.mesh.vertices);
    Mesh head = cut(all, at("neck") - Eigen::Vector3d(0, 0.04, 0), Eigen::Vector3d::UnitY());
    head = cut(head, {0.14, 0, 0}, -Eigen::Vector3d::UnitX());
    head = cut(head, {-0.14, 0, 0}, Eigen::Vector3d::UnitX());
    const Eigen::Vector3d wrist = at("left_wrist");
    const Eigen::Vector3d along = (wrist - at("left_elbow")).normalized();
    const Mesh hand =
        cut(cut(all, {0.3, 0, 0}, Eigen::Vector3d::UnitX()), wrist - 0.08 * along, along);
    const Mesh half = cut(all, Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX());
    const Eigen::Vector3d above = at("left_ankle") + Eigen::Vector3d(0, 0.09, 0);
    const Mesh foot = cut(half, above, -Eigen::Vector3d::UnitY());
    const PictureOptions size = tile(400, 400);
    const std::string who = male > 0 ? "man" : "woman";
    tiles.push_back({picture_of(head, View{0, 0.02}, size), who + ", front"});
    tiles.push_back({picture_of(head, View{0.75, 0.05}, size), "three quarters"});
    tiles.push_back({picture_of(head, View{1.57, 0.02}, size), "side"});
    tiles.push_back({picture_of(hand, View{1.2, 0.3}, size), "hand"});
    tiles.push_back({picture_of(hand, View{-1.3, -0.1}, size), "palm"});
    tiles.push_back({picture_of(foot, View{0.5, 0.7}, size), "foot"});
  }
  save(folder / "default_human_details.jpg", tiles, 6);
}

}  // namespace
}  // namespace atelier

int main(int argc, char** argv) {
  if (argc < 2) {
    std::puts("body_pictures FOLDER [shapes|poses|details]");
    return 2;
  }
  const std::string what = argc > 2 ? argv[2] : "";
  const std::filesystem::path folder = argv[1];
  if (what.empty() || what == "shapes") {
    atelier::shapes(folder);
  }
  if (what.empty() || what == "poses") {
    atelier::poses(folder);
  }
  if (what.empty() || what == "details") {
    atelier::details(folder);
  }
  return 0;
}
