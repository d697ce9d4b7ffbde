#include "core/render/interreflection.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/render/prepare.h"
#include "core/render/sampling.h"

namespace atelier {

namespace {

constexpr float kColorTexels = 128;  // a texture's side in the texels that a bounce tells apart
constexpr std::uint64_t kStream = 0x626F756E6365;  // apart from those of prepare

/// One value per vertex for each side of a mesh.
struct Sides {
  std::vector<Vec3f> front, back;
};

/// Unit normals by the area of the faces round each vertex; zero where it has none.
std::vector<Vec3f> normals_of(const PreparedMesh& mesh) {
  if (!mesh.normals.empty()) {
    return mesh.normals;
  }
  std::vector<Vec3f> sums(mesh.front_irradiance.size(), Vec3f{0, 0, 0});
  for (std::size_t f = 0; f + 2 < mesh.indices.size(); f += 3) {
    const Vec3f a = mesh.position(mesh.indices[f]);
    const Vec3f area =
        cross(mesh.position(mesh.indices[f + 1]) - a, mesh.position(mesh.indices[f + 2]) - a);
    for (std::size_t k = 0; k < 3; ++k) {
      sums[mesh.indices[f + k]] += area;
    }
  }
  for (Vec3f& n : sums) {
    n = normalized(n);
  }
  return sums;
}

/// Diffuse reflectance near each vertex.
Sides colors_of(const PreparedMesh& mesh) {
  const std::size_t count = mesh.front_irradiance.size();
  Sides colors;
  colors.front.assign(count, (1 - mesh.look.metallic) * vec3f(mesh.look.color));
  if (mesh.texture) {
    const auto width = static_cast<float>(mesh.texture->levels.front().width);
    for (std::size_t c = 0; c < mesh.indices.size(); ++c) {
      const Point2f uv = mesh.uvs[mesh.uv_indices[c]];
      colors.front[mesh.indices[c]] =
          product((1 - mesh.look.metallic) * vec3f(mesh.look.color),
                  texture_color(*mesh.texture, uv.x, uv.y, std::max(1.0f, width / kColorTexels)));
    }
  }
  for (std::size_t v = 0; v < mesh.colors.size(); ++v) {
    colors.front[v] = product(colors.front[v], mesh.colors[v]);
  }
  colors.back = colors.front;
  if (mesh.look.back_color) {
    colors.back.assign(count, vec3f(*mesh.look.back_color));
  }
  return colors;
}

bool is_lit(Vec3f irradiance) {
  return irradiance.x > 0 || irradiance.y > 0 || irradiance.z > 0;
}

/// Irradiance of the area lights at one vertex, with their shadows.
Vec3f light_of(const PreparedScene::Data& scene, Vec3f point, Vec3f normal, int count,
               std::uint32_t seed, OcclusionRays& rays) {
  Vec3f sum{0, 0, 0};
  const Vec3f origin = point + scene.epsilon * normal;
  for (std::size_t l = 0; l < scene.lights.size(); ++l) {
    const RectangleLight& light = scene.lights[l];
    const float form = form_factor(light, point, normal).value;
    if (form <= 0) {
      continue;
    }
    rays.clear();
    for (int k = 0; k < count; ++k) {
      const Point2f u = sobol_point(static_cast<std::uint32_t>(k),
                                    sobol::mixed_bits(seed + static_cast<std::uint32_t>(l) + 1));
      const Vec3f to_light = light_point(light, u) - origin;
      rays.add(origin, to_light, scene.epsilon / norm(to_light), 1 - 1e-4f);
    }
    rays.trace(scene.tree, false);
    int visible = 0;
    for (std::size_t ray = 0; ray < rays.size(); ++ray) {
      visible += rays.visible(ray) ? 1 : 0;
    }
    sum += (std::numbers::pi_v<float> * form * static_cast<float>(visible) /
            static_cast<float>(count)) *
           light.radiance;
  }
  return sum;
}

std::uint32_t seed_of(std::int64_t seed, std::size_t mesh, Index vertex) {
  return random_words(static_cast<std::uint64_t>(seed), kStream + mesh,
                      static_cast<std::uint64_t>(vertex))
      .word[0];
}

/// Radiance that each vertex reflects, the same in all directions.
std::vector<Sides> radiances(const PreparedScene::Data& scene,
                             const std::vector<std::vector<Vec3f>>& normals, std::int64_t seed,
                             int light_rays) {
  std::vector<Sides> result;
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
    const PreparedMesh& mesh = scene.meshes[m];
    Sides sides = colors_of(mesh);
    const auto count = static_cast<Index>(mesh.front_irradiance.size());
    parallel_for(count, 64, [&](Index begin, Index end) {
      OcclusionRays rays;
      for (Index v = begin; v < end; ++v) {
        const Vec3f p = mesh.position(static_cast<std::uint32_t>(v));
        const auto thrown = [&](Vec3f color, Vec3f irradiance, Vec3f normal) {
          if (!is_lit(irradiance)) {
            return Vec3f{0, 0, 0};  // what sees no sky sees no light: inside, or of no face
          }
          return (1 / std::numbers::pi_v<float>)*product(
              color,
              irradiance + light_of(scene, p, normal, light_rays, seed_of(seed, m, v), rays));
        };
        const Vec3f n = normals[m][v];
        sides.front[v] = thrown(sides.front[v], mesh.front_irradiance[v], n);
        sides.back[v] = thrown(sides.back[v], mesh.back_irradiance[v], -n);
      }
    });
    result.push_back(std::move(sides));
  }
  return result;
}

/// Radiance that arrives where a ray hit.
Vec3f arriving(const PreparedScene::Data& scene, const std::vector<Sides>& thrown,
               const RTCRayHit16& packet, int lane) {
  const std::uint32_t m = packet.hit.geomID[lane];
  const PreparedMesh& mesh = scene.meshes[m];
  std::array<std::uint32_t, 3> v{};
  for (std::size_t k = 0; k < 3; ++k) {
    v[k] = mesh.indices[3 * packet.hit.primID[lane] + k];
  }
  const Vec3f a = mesh.position(v[0]);
  const Vec3f facet = cross(mesh.position(v[1]) - a, mesh.position(v[2]) - a);
  const Vec3f direction{packet.ray.dir_x[lane], packet.ray.dir_y[lane], packet.ray.dir_z[lane]};
  const std::vector<Vec3f>& side = dot(facet, direction) > 0 ? thrown[m].back : thrown[m].front;
  const float u = packet.hit.u[lane];
  const float w = packet.hit.v[lane];
  return (1 - u - w) * side[v[0]] + u * side[v[1]] + w * side[v[2]];
}

/// Irradiance from the meshes about a vertex.
Vec3f gathered_bounce(const PreparedScene::Data& scene, const std::vector<Sides>& thrown,
                      Vec3f point, Vec3f normal, int count, std::uint32_t seed) {
  const Frame frame(normal);
  const Vec3f origin = point + scene.epsilon * normal;
  Vec3f sum{0, 0, 0};
  for (int first = 0; first < count; first += 16) {
    RTCRayHit16 packet{};
    for (int lane = 0; lane < 16; ++lane) {
      const bool used = first + lane < count;
      const Vec3f d = frame.world(
          cosine_direction(sobol_point(static_cast<std::uint32_t>(first + lane) & 0xFFFFu, seed)));
      packet.ray.org_x[lane] = origin.x;
      packet.ray.org_y[lane] = origin.y;
      packet.ray.org_z[lane] = origin.z;
      packet.ray.dir_x[lane] = d.x;
      packet.ray.dir_y[lane] = d.y;
      packet.ray.dir_z[lane] = d.z;
      packet.ray.tnear[lane] = used ? scene.epsilon : 1;
      packet.ray.tfar[lane] = used ? std::numeric_limits<float>::infinity() : 0;
      packet.ray.mask[lane] = ~0u;
      packet.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
      packet.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
    }
    scene.tree.intersect(packet);
    for (int lane = 0; lane < 16; ++lane) {
      if (packet.hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID) {
        sum += arriving(scene, thrown, packet, lane);
      }
    }
  }
  return (std::numbers::pi_v<float> / static_cast<float>(count)) * sum;
}

/// Half way to the mean of the neighbours. Few rays are noise that the eye finds.
std::vector<Vec3f> smoothed(const PreparedMesh& mesh, const std::vector<Vec3f>& values) {
  std::vector<Vec3f> sums(values.size(), Vec3f{0, 0, 0});
  std::vector<int> counts(values.size(), 0);
  for (std::size_t f = 0; f + 2 < mesh.indices.size(); f += 3) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = mesh.indices[f + k];
      const std::uint32_t b = mesh.indices[f + (k + 1) % 3];
      sums[a] += values[b];
      sums[b] += values[a];
      ++counts[a];
      ++counts[b];
    }
  }
  for (std::size_t v = 0; v < values.size(); ++v) {
    sums[v] = counts[v] > 0 ? mix(values[v], (1 / static_cast<float>(counts[v])) * sums[v], 0.5f)
                            : values[v];
  }
  return sums;
}

}  // namespace

PreparedScene prepare_with_bounce(const Scene& scene, const PrepareOptions& options,
                                  const BounceOptions& bounce, const PreparedTextures& textures) {
  ATELIER_CHECK(options.ambient == Ambient::PerVertex, "a bounce needs Ambient::PerVertex");
  ATELIER_CHECK(bounce.rays >= 1 && bounce.rays <= 65536, "rays must lie in [1, 65536]");
  ATELIER_CHECK(bounce.light_rays >= 1 && bounce.light_rays <= 256,
                "light_rays must lie in [1, 256]");
  ATELIER_CHECK(bounce.smoothings >= 0 && bounce.smoothings <= 100,
                "smoothings must lie in [0, 100]");
  const std::shared_ptr<PreparedScene::Data> data = prepared_data(scene, options, textures);
  std::vector<std::vector<Vec3f>> normals;
  for (const PreparedMesh& mesh : data->meshes) {
    normals.push_back(normals_of(mesh));
  }
  const std::vector<Sides> thrown = radiances(*data, normals, options.seed, bounce.light_rays);
  for (std::size_t m = 0; m < data->meshes.size(); ++m) {
    PreparedMesh& mesh = data->meshes[m];
    const auto count = static_cast<Index>(mesh.front_irradiance.size());
    Sides gathered{std::vector<Vec3f>(mesh.front_irradiance.size(), Vec3f{0, 0, 0}),
                   std::vector<Vec3f>(mesh.back_irradiance.size(), Vec3f{0, 0, 0})};
    parallel_for(count, 64, [&](Index begin, Index end) {
      for (Index v = begin; v < end; ++v) {
        const Vec3f p = mesh.position(static_cast<std::uint32_t>(v));
        const std::uint32_t seed = seed_of(options.seed, m, v);
        if (is_lit(mesh.front_irradiance[v])) {
          gathered.front[v] = gathered_bounce(*data, thrown, p, normals[m][v], bounce.rays, seed);
        }
        if (is_lit(mesh.back_irradiance[v])) {
          gathered.back[v] = gathered_bounce(*data, thrown, p, -normals[m][v], bounce.rays, seed);
        }
      }
    });
    for (int i = 0; i < bounce.smoothings; ++i) {
      gathered.front = smoothed(mesh, gathered.front);
      gathered.back = smoothed(mesh, gathered.back);
    }
    for (Index v = 0; v < count; ++v) {
      mesh.front_irradiance[v] += gathered.front[v];
      mesh.back_irradiance[v] += gathered.back[v];
    }
  }
  return PreparedScene(data);
}

}  // namespace atelier
