#include "core/render/prepare.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "core/normals.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/render/gather_ground_shadows.h"
#include "core/render/reflectance.h"

#if defined(__SANITIZE_THREAD__)
// Embree's and FFmpeg's threads wait for one another in ways that an uninstrumented library does
// not show.
extern "C" const char* __tsan_default_suppressions() {
  return "race:libembree3.so\nrace:libavcodec.so\nrace:libavutil.so\n";
}
#endif

namespace atelier {

namespace {

constexpr int kGroundCells = 128;  // a side of the grid on which the ground's light is gathered

struct Bounds {
  Vec3f min{std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity(),
            std::numeric_limits<float>::infinity()};
  Vec3f max{-std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
            -std::numeric_limits<float>::infinity()};
};

std::vector<Vec3f> smooth_normals(const Mesh& mesh) {
  const Points normals = mesh.normals.rows() == mesh.vertices.rows()
                             ? mesh.normals
                             : vertex_normals(mesh.vertices, mesh.faces);
  std::vector<Vec3f> result(static_cast<std::size_t>(normals.rows()));
  for (Index i = 0; i < normals.rows(); ++i) {
    result[i] = normalized(vec3f(Eigen::Vector3d(normals.row(i))));
  }
  return result;
}

PreparedMesh prepared_mesh(const RenderMesh& source) {
  const Mesh& mesh = source.mesh;
  PreparedMesh result;
  result.look = source.look;
  result.positions.reserve(static_cast<std::size_t>(mesh.vertices.size()) + 1);
  for (Index i = 0; i < mesh.vertices.rows(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const auto value = static_cast<float>(mesh.vertices(i, c));
      if (!std::isfinite(value)) {
        throw DataError("scene", "vertex " + std::to_string(i),
                        "a coordinate beyond what floats hold", "metres");
      }
      result.positions.push_back(value);
    }
  }
  result.positions.push_back(0);
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      result.indices.push_back(static_cast<std::uint32_t>(mesh.faces(f, k)));
    }
  }
  if (source.look.smooth) {
    result.normals = smooth_normals(mesh);
  }
  if (source.look.vertex_colors) {
    for (Index i = 0; i < mesh.colors.rows(); ++i) {
      result.colors.push_back({mesh.colors(i, 0), mesh.colors(i, 1), mesh.colors(i, 2)});
    }
  }
  for (Index i = 0; i < mesh.uvs.rows(); ++i) {
    result.uvs.push_back({static_cast<float>(mesh.uvs(i, 0)), static_cast<float>(mesh.uvs(i, 1))});
  }
  for (Index f = 0; f < mesh.uv_faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      result.uv_indices.push_back(static_cast<std::uint32_t>(mesh.uv_faces(f, k)));
    }
  }
  return result;
}

Bounds bounds_of(const std::vector<PreparedMesh>& meshes) {
  Bounds b;
  for (const PreparedMesh& mesh : meshes) {
    for (const std::uint32_t i : mesh.indices) {
      const Vec3f p = mesh.position(i);
      b.min = {std::min(b.min.x, p.x), std::min(b.min.y, p.y), std::min(b.min.z, p.z)};
      b.max = {std::max(b.max.x, p.x), std::max(b.max.y, p.y), std::max(b.max.z, p.z)};
    }
  }
  if (b.min.x > b.max.x) {
    b.min = b.max = {0, 0, 0};
  }
  return b;
}

std::shared_ptr<const MipPyramid> filtered_texture(PreparedTextures::Data& known,
                                                   const std::shared_ptr<const Image>& source) {
  PreparedTextures::Data::Texture& texture = known.textures[source.get()];
  if (!texture.pyramid) {
    texture = {source, std::make_shared<const MipPyramid>(mip_pyramid(*source))};
  }
  return texture.pyramid;
}

std::uint32_t stream_seed(std::int64_t seed, std::uint64_t stream, std::uint64_t counter) {
  return random_words(static_cast<std::uint64_t>(seed), stream, counter).word[0];
}

// Light that the ground, lit by everything and blocked by nothing, reflects upwards.
Vec3f ground_radiance(const Ground& ground, const std::vector<RectangleLight>& lights,
                      const EnvironmentLight& environment, Vec3f point) {
  Vec3f irradiance = open_irradiance(environment, {0, 1, 0});
  for (const RectangleLight& light : lights) {
    irradiance +=
        std::numbers::pi_v<float> * form_factor(light, point, {0, 1, 0}).value * light.radiance;
  }
  return (1 / std::numbers::pi_v<float>)*product(vec3f(ground.color), irradiance);
}

void gather_vertices(PreparedScene::Data& scene,
                     const std::vector<std::vector<Vec3f>>& vertex_directions,
                     const PrepareOptions& options) {
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
    PreparedMesh& mesh = scene.meshes[m];
    const std::size_t count = mesh.positions.size() / 3;
    // Facets, too, have but one value per vertex: that of their mean.
    const std::vector<Vec3f>& normals = vertex_directions[m];
    mesh.front_irradiance.assign(count, Vec3f{0, 0, 0});
    mesh.back_irradiance.assign(count, Vec3f{0, 0, 0});
    parallel_for(static_cast<Index>(count), 64, [&](Index begin, Index end) {
      OcclusionRays rays;
      for (Index i = begin; i < end; ++i) {
        const Vec3f n = normals[i];
        if (squared_norm(n) == 0) {
          continue;  // a vertex of no face, or of faces without area
        }
        const Vec3f p = mesh.position(static_cast<std::uint32_t>(i));
        const std::uint32_t seed = stream_seed(options.seed, m, static_cast<std::uint64_t>(i));
        mesh.front_irradiance[i] =
            gathered_irradiance(scene, p, n, options.vertex_samples, seed, rays);
        // Most meshes are closed, and their inside is dark: a few rays tell.
        const int few = std::min(16, options.vertex_samples);
        if (luminance(gathered_irradiance(scene, p, -n, few, seed, rays)) > 0) {
          mesh.back_irradiance[i] =
              gathered_irradiance(scene, p, -n, options.vertex_samples, seed, rays);
        }
      }
    });
  }
}

void gather_ground(PreparedScene::Data& scene, const Bounds& bounds,
                   const PrepareOptions& options) {
  const float height = static_cast<float>(scene.ground->height);
  const float reach = std::max(0.1f, 1.5f * (bounds.max.y - height));
  const float side =
      options.ground_reach > 0
          ? 2 * static_cast<float>(options.ground_reach)
          : std::max(bounds.max.x - bounds.min.x, bounds.max.z - bounds.min.z) + 2 * reach;
  GroundIrradiance& grid = scene.ground_irradiance;
  grid.cell = side / (kGroundCells - 1);
  grid.min_x = 0.5f * (bounds.min.x + bounds.max.x - side);
  grid.min_z = 0.5f * (bounds.min.z + bounds.max.z - side);
  grid.values = Image(kGroundCells, kGroundCells, 3);
  parallel_for(kGroundCells, 1, [&](Index begin, Index end) {
    OcclusionRays rays;
    for (int j = static_cast<int>(begin); j < end; ++j) {
      for (int i = 0; i < kGroundCells; ++i) {
        const Vec3f p{grid.min_x + grid.cell * static_cast<float>(i), height,
                      grid.min_z + grid.cell * static_cast<float>(j)};
        const std::uint32_t seed = stream_seed(
            options.seed, scene.meshes.size(),
            static_cast<std::uint64_t>(j) * kGroundCells + static_cast<std::uint64_t>(i));
        const Vec3f e =
            gathered_irradiance(scene, p, {0, 1, 0}, options.vertex_samples, seed, rays);
        grid.values.at(i, j, 0) = e.x;
        grid.values.at(i, j, 1) = e.y;
        grid.values.at(i, j, 2) = e.z;
      }
    }
  });
}

// True if no light reaches below the ground: then its form factor is that of all of it.
bool lights_are_above(const PreparedScene::Data& scene) {
  const auto height = static_cast<float>(scene.ground->height);
  return std::all_of(scene.lights.begin(), scene.lights.end(), [&](const RectangleLight& light) {
    return light.center.y - std::abs(light.half_u.y) - std::abs(light.half_v.y) > height;
  });
}

}  // namespace

Vec3f gathered_irradiance(const PreparedScene::Data& scene, Vec3f point, Vec3f normal, int count,
                          std::uint32_t seed, OcclusionRays& rays) {
  const Frame frame(normal);
  const Vec3f origin = point + scene.epsilon * normal;
  Vec3f sum{0, 0, 0};
  // In runs of at most this many, so that the scratch stays in cache.
  constexpr int kRun = 256;
  std::array<Vec3f, kRun> light;
  for (int first = 0; first < count; first += kRun) {
    rays.clear();
    const int last = std::min(count, first + kRun);
    for (int i = first; i < last; ++i) {
      const EnvironmentSample s =
          sample_environment(scene.environment, frame, static_cast<std::uint32_t>(i), seed);
      if (s.weight > 0) {
        const std::size_t ray =
            rays.add(origin, s.direction, scene.epsilon, std::numeric_limits<float>::infinity());
        light[ray] = s.weight * radiance(scene.environment, s.direction);
      }
    }
    rays.trace(scene.tree, false);
    for (std::size_t ray = 0; ray < rays.size(); ++ray) {
      if (rays.visible(ray)) {
        sum += light[ray];
      }
    }
  }
  return (1 / static_cast<float>(count)) * sum;
}

std::shared_ptr<PreparedScene::Data> prepared_data(const Scene& scene,
                                                   const PrepareOptions& options,
                                                   const PreparedTextures& textures) {
  ATELIER_CHECK(options.vertex_samples >= 1 && options.vertex_samples <= 65536,
                "vertex_samples must lie in [1, 65536]");
  ATELIER_CHECK(options.ground_reach >= 0 && options.ground_reach <= 1000,
                "ground_reach must lie in [0, 1000]");
  ATELIER_CHECK(options.ground_shadow_rays >= 0 && options.ground_shadow_rays <= kMaxRays,
                "ground_shadow_rays must lie in [0, 1024]");
  ATELIER_CHECK(options.ground_shadow_reach >= 1 && options.ground_shadow_reach <= 50,
                "ground_shadow_reach must lie in [1, 50]");
  check_scene(scene);
  prepare_reflectance_tables();
  auto data = std::make_shared<PreparedScene::Data>();
  data->ambient = options.ambient;
  data->background = scene.background;
  data->ground = scene.ground;
  for (const AreaLight& light : scene.area_lights) {
    data->lights.push_back(rectangle_light(light));
  }

  PreparedTextures::Data filtered;
  if (textures.data() != nullptr) {
    filtered = *textures.data();
  }
  for (const RenderMesh& mesh : scene.meshes) {
    data->meshes.push_back(prepared_mesh(mesh));
    if (mesh.look.texture) {
      data->meshes.back().texture = filtered_texture(filtered, mesh.look.texture);
    }
  }
  for (const PreparedMesh& mesh : data->meshes) {
    data->tree.add(mesh.positions, mesh.indices);
  }
  data->tree.build();

  const Bounds bounds = bounds_of(data->meshes);
  data->epsilon = std::max(1e-6f, 2e-5f * norm(bounds.max - bounds.min));

  data->environment = environment_light(scene.environment, std::nullopt);
  if (scene.ground) {
    const Vec3f foot{0.5f * (bounds.min.x + bounds.max.x), static_cast<float>(scene.ground->height),
                     0.5f * (bounds.min.z + bounds.max.z)};
    data->open_ground_irradiance = open_irradiance(data->environment, {0, 1, 0});
    data->environment = environment_light(
        scene.environment, ground_radiance(*scene.ground, data->lights, data->environment, foot));
  }
  if (options.ambient == Ambient::PerVertex) {
    std::vector<std::vector<Vec3f>> vertex_directions;
    for (const RenderMesh& mesh : scene.meshes) {
      vertex_directions.push_back(smooth_normals(mesh.mesh));
    }
    gather_vertices(*data, vertex_directions, options);
    if (scene.ground) {
      gather_ground(*data, bounds, options);
    }
  }
  if (options.ground_shadow_rays > 0 && scene.ground && scene.ground->seamless &&
      lights_are_above(*data)) {
    data->ground_shadows = gathered_ground_shadows(
        *data, 0.5f * (bounds.min.x + bounds.max.x), 0.5f * (bounds.min.z + bounds.max.z),
        static_cast<float>(options.ground_shadow_reach), options.ground_shadow_rays);
  }
  return data;
}

PreparedTextures prepare_textures(const std::vector<Look>& looks) {
  auto data = std::make_shared<PreparedTextures::Data>();
  for (const Look& look : looks) {
    if (look.texture) {
      filtered_texture(*data, look.texture);
    }
  }
  return PreparedTextures(std::move(data));
}

PreparedScene prepare(const Scene& scene, const PrepareOptions& options,
                      const PreparedTextures& textures) {
  return PreparedScene(prepared_data(scene, options, textures));
}

}  // namespace atelier
