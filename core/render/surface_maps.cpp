#include "core/render/surface_maps.h"

#include <algorithm>
#include <array>
#include <limits>

#include "core/error.h"
#include "core/parallel.h"
#include "core/render/occupied_tiles.h"

namespace atelier {

namespace {

constexpr int kPacket = 16;  // rays that are traced together

void put(Image& image, int x, int y, Vec3f value) {
  image.at(x, y, 0) = value.x;
  image.at(x, y, 1) = value.y;
  image.at(x, y, 2) = value.z;
}

void fill(SurfaceMaps& maps, const PreparedScene::Data& scene, const Camera& camera, int x, int y,
          std::uint32_t mesh_idx, std::uint32_t face, float u, float v) {
  const PreparedMesh& mesh = scene.meshes[mesh_idx];
  const std::array<float, 3> weight{1 - u - v, u, v};
  std::array<std::uint32_t, 3> vertex{};
  Vec3f position{0, 0, 0};
  for (std::uint32_t k = 0; k < 3; ++k) {
    vertex[k] = mesh.indices[3 * face + k];
    position += weight[k] * mesh.position(vertex[k]);
  }
  Vec3f normal{0, 0, 0};
  if (mesh.normals.empty()) {
    const Vec3f a = mesh.position(vertex[0]);
    normal = cross(mesh.position(vertex[1]) - a, mesh.position(vertex[2]) - a);
  } else {
    for (std::size_t k = 0; k < 3; ++k) {
      normal += weight[k] * mesh.normals[vertex[k]];
    }
  }
  maps.mesh.at(x, y) = static_cast<int>(mesh_idx);
  maps.face.at(x, y) = static_cast<int>(face);
  put(maps.barycentric, x, y, {weight[0], weight[1], weight[2]});
  put(maps.position, x, y, position);
  put(maps.normal, x, y, normalized(normal));
  const Eigen::Vector3d in_camera =
      camera_from_world(camera, Eigen::Vector3d(position.x, position.y, position.z));
  maps.depth.at(x, y) = static_cast<float>(in_camera.z());
  if (!mesh.uv_indices.empty()) {
    float tu = 0;
    float tv = 0;
    for (std::uint32_t k = 0; k < 3; ++k) {
      const Point2f t = mesh.uvs[mesh.uv_indices[3 * face + k]];
      tu += weight[k] * t.x;
      tv += weight[k] * t.y;
    }
    maps.uv.at(x, y, 0) = tu;
    maps.uv.at(x, y, 1) = tv;
  }
}

}  // namespace

SurfaceMaps surface_maps(const PreparedScene& scene, const Camera& camera, std::size_t meshes) {
  check_camera(camera);
  const int w = camera.width;
  const int h = camera.height;
  SurfaceMaps maps{ImageOf<int>(w, h, 1, -1),
                   ImageOf<int>(w, h, 1, -1),
                   Image(w, h, 3),
                   Image(w, h, 1),
                   Image(w, h, 3),
                   Image(w, h, 3),
                   Image(w, h, 2)};
  const Vec3f eye = vec3f(camera_center(camera));
  const OccupiedTiles occupied = occupied_tiles(scene.data(), camera, kPacket, meshes);
  parallel_for(h, 1, [&](Index begin, Index end) {
    for (int y = static_cast<int>(begin); y < end; ++y) {
      for (int x0 = 0; x0 < w; x0 += kPacket) {
        if (!occupied.at(x0 / kPacket, y / kPacket)) {
          continue;  // inverting the lens costs as much as the ray
        }
        RTCRayHit16 packet{};
        for (int lane = 0; lane < kPacket; ++lane) {
          const int x = x0 + lane;
          const auto direction = x < w ? ray_direction(camera, {x + 0.5, y + 0.5}) : std::nullopt;
          const Vec3f d = direction ? vec3f(*direction) : Vec3f{0, 0, 1};
          packet.ray.org_x[lane] = eye.x;
          packet.ray.org_y[lane] = eye.y;
          packet.ray.org_z[lane] = eye.z;
          packet.ray.dir_x[lane] = d.x;
          packet.ray.dir_y[lane] = d.y;
          packet.ray.dir_z[lane] = d.z;
          packet.ray.tnear[lane] = direction ? 0.0f : 1.0f;
          packet.ray.tfar[lane] = direction ? std::numeric_limits<float>::infinity() : 0.0f;
          packet.ray.mask[lane] = ~0u;
          packet.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
          packet.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
        }
        scene.data().tree.intersect(packet);
        for (int lane = 0; lane < kPacket && x0 + lane < w; ++lane) {
          if (packet.hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID &&
              packet.hit.geomID[lane] < meshes) {
            fill(maps, scene.data(), camera, x0 + lane, y, packet.hit.geomID[lane],
                 packet.hit.primID[lane], packet.hit.u[lane], packet.hit.v[lane]);
          }
        }
      }
    }
  });
  return maps;
}

std::vector<bool> visible_points(const PreparedScene& scene, const Camera& camera,
                                 const Points& points, double tolerance) {
  check_camera(camera);
  ATELIER_CHECK(tolerance >= 0, "tolerance must not be negative");
  const Vec3f eye = vec3f(camera_center(camera));
  const Index count = points.rows();
  std::vector<char> seen(static_cast<std::size_t>(count), 0);
  parallel_for(count, 1024, [&](Index begin, Index end) {
    OcclusionRays rays;
    std::vector<Index> asked;
    for (Index i = begin; i < end; ++i) {
      const Eigen::Vector3d point = points.row(i);
      const auto pixel = project(camera, point);
      if (!pixel || !(pixel->x() >= 0 && pixel->x() < camera.width && pixel->y() >= 0 &&
                      pixel->y() < camera.height)) {
        continue;
      }
      const Vec3f to_point = vec3f(point) - eye;
      const float distance = norm(to_point);
      if (distance > 0) {
        rays.add(eye, (1 / distance) * to_point, 0, distance - static_cast<float>(tolerance));
        asked.push_back(i);
      }
    }
    rays.trace(scene.data().tree, true);
    for (std::size_t ray = 0; ray < asked.size(); ++ray) {
      seen[static_cast<std::size_t>(asked[ray])] = rays.visible(ray) ? 1 : 0;
    }
  });
  return {seen.begin(), seen.end()};
}

}  // namespace atelier
