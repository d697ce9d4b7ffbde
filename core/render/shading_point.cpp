#include "core/render/shading_point.h"

#include <algorithm>
#include <numbers>

#include "core/render/reflectance.h"
#include "core/saturating_cast.h"

namespace atelier {

namespace {

struct Corners {
  std::uint32_t vertex[3];
  Vec3f position[3];
  float weight[3];
};

template <class T>
T interpolated(const Corners& c, const std::vector<T>& values) {
  return c.weight[0] * values[c.vertex[0]] + c.weight[1] * values[c.vertex[1]] +
         c.weight[2] * values[c.vertex[2]];
}

// Texture footprint: texels under a pixel, from the ratio of the triangle's areas in texture and
// space; the view's slant lengthens only one side, hence its square root.
Vec3f textured(const PreparedMesh& mesh, const Corners& c, std::uint32_t face, float area2,
               float pixel_width, float slant, int samples) {
  const Point2f t0 = mesh.uvs[mesh.uv_indices[3 * face]];
  const Point2f t1 = mesh.uvs[mesh.uv_indices[3 * face + 1]];
  const Point2f t2 = mesh.uvs[mesh.uv_indices[3 * face + 2]];
  const float u = c.weight[0] * t0.x + c.weight[1] * t1.x + c.weight[2] * t2.x;
  const float v = c.weight[0] * t0.y + c.weight[1] * t1.y + c.weight[2] * t2.y;
  const float uv_area2 = std::abs((t1.x - t0.x) * (t2.y - t0.y) - (t2.x - t0.x) * (t1.y - t0.y));
  const Image& image = mesh.texture->levels.front();
  const float texels2 =
      uv_area2 * static_cast<float>(image.width) * static_cast<float>(image.height);
  const float per_metre = area2 > 0 ? std::sqrt(texels2 / area2) : 0.0f;
  const float footprint =
      per_metre * pixel_width / std::sqrt(std::max(0.05f, slant) * static_cast<float>(samples));
  return texture_color(*mesh.texture, u, v, footprint);
}

// True within `half_width` of an edge; heights over the edges are barycentrics times altitudes.
bool on_edge(const Corners& c, float area2, float half_width) {
  for (int k = 0; k < 3; ++k) {
    const float length = norm(c.position[(k + 2) % 3] - c.position[(k + 1) % 3]);
    if (c.weight[k] * area2 < half_width * length) {
      return true;
    }
  }
  return false;
}

void split_layers(ShadingPoint& p, float metallic, float specular) {
  const float dielectric = 0.08f * specular;
  p.diffuse = (1 - metallic) * p.base;
  p.f0 = mix(Vec3f{dielectric, dielectric, dielectric}, p.base, metallic);
  p.gloss = specular > 0 || metallic > 0 ? 1.0f : 0.0f;
  p.base_share = p.sheen > 0 ? 1 - p.sheen * sheen_albedo(p.n_dot_v) : 1.0f;
  p.diffuse_share = {1, 1, 1};
  if (p.gloss > 0) {
    const GlossAlbedo a = gloss_albedo(p.n_dot_v, p.roughness);
    // Turquin, "Practical multiple scattering compensation for microfacet models", 2019.
    const float lost = 1 / std::max(0.05f, a.scale + a.bias) - 1;
    p.rebound = Vec3f{1, 1, 1} + lost * p.f0;
    // The dielectric's albedo, so that a half-metal's base is not dimmed twice.
    const float e = (dielectric * a.scale + a.bias) * (1 + lost * dielectric);
    p.diffuse_share = {1 - e, 1 - e, 1 - e};
  }
}

}  // namespace

ShadingPoint shading_point(const PreparedScene::Data& scene, const MeshHit& hit, Vec3f origin,
                           Vec3f direction, float pixel_angle, int samples) {
  const PreparedMesh& mesh = scene.meshes[hit.mesh];
  const Look& look = mesh.look;
  Corners c{};
  c.weight[0] = 1 - hit.u - hit.v;
  c.weight[1] = hit.u;
  c.weight[2] = hit.v;
  for (int k = 0; k < 3; ++k) {
    c.vertex[k] = mesh.indices[3 * hit.face + static_cast<std::uint32_t>(k)];
    c.position[k] = mesh.position(c.vertex[k]);
  }
  ShadingPoint p{};
  p.view = -direction;
  // From the corners: more exact than origin + distance * direction far from the camera.
  p.position =
      c.weight[0] * c.position[0] + c.weight[1] * c.position[1] + c.weight[2] * c.position[2];
  const Vec3f area = cross(c.position[1] - c.position[0], c.position[2] - c.position[0]);
  const float area2 = norm(area);
  p.facet = normalized(area);
  const bool back = dot(p.facet, p.view) < 0;
  if (back) {
    p.facet = -p.facet;
  }
  p.normal = p.facet;
  if (!mesh.normals.empty()) {
    const Vec3f n = interpolated(c, mesh.normals);
    if (squared_norm(n) > 1e-12f) {
      p.normal = normalized(back ? -n : n);
    }
    // Light is received from the smooth surface that the normals stand for, so that its terminator
    // does not show the facets (Hanika, "Hacking the shadow terminator", Ray Tracing Gems II 2021).
    Vec3f shift{0, 0, 0};
    for (int k = 0; k < 3; ++k) {
      const Vec3f nk = back ? -mesh.normals[c.vertex[k]] : mesh.normals[c.vertex[k]];
      shift += (c.weight[k] * std::min(0.0f, dot(p.position - c.position[k], nk))) * nk;
    }
    p.position -= shift;
  }
  p.n_dot_v = dot(p.normal, p.view);
  if (p.n_dot_v < 0.02f) {
    // A shading normal that looks away: bent back to just facing the viewer.
    p.normal = normalized(p.normal + (0.02f - p.n_dot_v) * p.view);
    p.n_dot_v = std::max(0.02f, dot(p.normal, p.view));
  }

  const Vec3f offset = p.position - origin;
  const float pixel_width = pixel_angle * norm(offset);
  if (back && look.back_color) {
    p.base = vec3f(*look.back_color);
  } else {
    p.base = vec3f(look.color);
    if (mesh.texture) {
      p.base = product(
          p.base, textured(mesh, c, hit.face, area2, pixel_width, dot(p.facet, p.view), samples));
    }
    if (!mesh.colors.empty()) {
      p.base = product(p.base, interpolated(c, mesh.colors));
    }
  }
  if (look.edge_color && on_edge(c, area2, 0.5f * look.edge_width * pixel_width)) {
    p.base = vec3f(*look.edge_color);
  }
  p.roughness = look.roughness;
  p.sheen = look.sheen;
  split_layers(p, look.metallic, look.specular);
  if (!mesh.front_irradiance.empty()) {
    p.ambient = interpolated(c, back ? mesh.back_irradiance : mesh.front_irradiance);
  }
  return p;
}

ShadingPoint ground_point(const PreparedScene::Data& scene, Vec3f position, Vec3f direction) {
  ShadingPoint p{};
  p.position = position;
  p.facet = p.normal = {0, 1, 0};
  p.view = -direction;
  p.n_dot_v = std::max(0.02f, p.view.y);
  p.roughness = 1;
  p.base = vec3f(scene.ground->color);
  split_layers(p, 0, 0);
  const GroundIrradiance& grid = scene.ground_irradiance;
  p.ambient = scene.open_ground_irradiance;
  if (!grid.values.data.empty()) {
    const float x = (position.x - grid.min_x) / grid.cell;
    const float z = (position.z - grid.min_z) / grid.cell;
    const float last = static_cast<float>(grid.values.width - 1);
    if (x >= 0 && z >= 0 && x < last && z < last) {
      const int i = saturating_cast<int>(x);
      const int j = saturating_cast<int>(z);
      const float fx = x - static_cast<float>(i);
      const float fz = z - static_cast<float>(j);
      const auto read = [&](int a, int b) {
        const float* t = &grid.values.at(a, b);
        return Vec3f{t[0], t[1], t[2]};
      };
      const Vec3f e =
          mix(mix(read(i, j), read(i + 1, j), fx), mix(read(i, j + 1), read(i + 1, j + 1), fx), fz);
      // The last cells lead over to the open ground outside.
      const float border = std::min(std::min(x, last - x), std::min(z, last - z));
      p.ambient = mix(p.ambient, e, std::min(1.0f, border / 8));
    }
  }
  return p;
}

Vec3f diffuse_light(const ShadingPoint& point, Vec3f irradiance) {
  return (point.base_share / std::numbers::pi_v<float>)*product(
      product(point.diffuse, point.diffuse_share), irradiance);
}

Vec3f gloss_towards_viewer(const ShadingPoint& point, Vec3f light_direction, float n_dot_l) {
  Vec3f result{0, 0, 0};
  if (point.gloss <= 0 && point.sheen <= 0) {
    return result;
  }
  const Vec3f half = normalized(point.view + light_direction);
  const float n_dot_h = std::clamp(dot(point.normal, half), 0.0f, 1.0f);
  if (point.gloss > 0) {
    const float w = fresnel_weight(dot(point.view, half));
    const float strength = ggx(point.n_dot_v, n_dot_l, n_dot_h, point.roughness) * n_dot_l;
    result +=
        (point.base_share * strength) * product(point.rebound, mix(point.f0, Vec3f{1, 1, 1}, w));
  }
  if (point.sheen > 0) {
    const float s = point.sheen * sheen(point.n_dot_v, n_dot_l, n_dot_h) * n_dot_l;
    result += {s, s, s};
  }
  return result;
}

Vec3f ambient_light(const PreparedScene::Data& scene, const ShadingPoint& point, Vec3f irradiance,
                    float openness) {
  Vec3f result = diffuse_light(point, irradiance);
  if (point.gloss > 0) {
    const GlossAlbedo a = gloss_albedo(point.n_dot_v, point.roughness);
    const Vec3f reflected = 2 * point.n_dot_v * point.normal - point.view;
    const Vec3f e = product(point.rebound, a.scale * point.f0 + Vec3f{a.bias, a.bias, a.bias});
    result +=
        (point.base_share * openness) *
        product(e, glossy_radiance(scene.environment, normalized(reflected), point.roughness));
  }
  if (point.sheen > 0) {
    result += (point.sheen * sheen_albedo(point.n_dot_v) / std::numbers::pi_v<float>)*irradiance;
  }
  return result;
}

}  // namespace atelier
