// bench_appearance_network [cuda]: one image of a dressed person, body of 10,000 vertices and
// garment of 10,000, a network each, into an image of 1024 x 1024, with everything that a new
// frame costs, as a whole and part by part (the device waited for between them, so that parts do
// not overlap and sum to more). Networks are random: the arithmetic does not ask what they learnt.
// A program of its own, since Google Benchmark and libtorch 2 share symbols and crash.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <numbers>

#include "appearance/network/painter.h"

namespace atelier {
namespace {

constexpr int kSide = 1024;   // px
constexpr int kAround = 100;  // vertices
constexpr int kAlong = 99;    // their rows

/// A tube round the Y axis with one chart.
Mesh tube(double radius) {
  Mesh mesh;
  mesh.vertices.resize(kAround * (kAlong + 1), 3);
  mesh.faces.resize(2 * kAround * kAlong, 3);
  mesh.uvs.resize((kAround + 1) * (kAlong + 1), 2);
  mesh.uv_faces.resize(mesh.faces.rows(), 3);
  Index f = 0;
  for (int j = 0; j <= kAlong; ++j) {
    for (int i = 0; i <= kAround; ++i) {
      mesh.uvs.row(j * (kAround + 1) + i) << 0.02 + 0.96 * i / kAround, 0.02 + 0.96 * j / kAlong;
      if (i == kAround) {
        continue;
      }
      const double angle = 2 * std::numbers::pi * i / kAround;
      mesh.vertices.row(j * kAround + i) << radius * std::cos(angle), 1.6 * j / kAlong,
          -radius * std::sin(angle);
      if (j < kAlong) {
        const int a = j * kAround + i;
        const int b = j * kAround + (i + 1) % kAround;
        const int t = j * (kAround + 1) + i;
        mesh.faces.row(f) << a, b, a + kAround;
        mesh.uv_faces.row(f++) << t, t + 1, t + kAround + 1;
        mesh.faces.row(f) << a + kAround, b, b + kAround;
        mesh.uv_faces.row(f++) << t + kAround + 1, t + 1, t + kAround + 2;
      }
    }
  }
  return mesh;
}

struct Case {
  int texels, channels, shading, strata, samples;
};

/// A network as before training, whose last convolutions give something.
std::shared_ptr<const AppearanceModel> model_of(const Mesh& mesh, const Case& one) {
  AppearanceData data;
  data.name = "tube";
  data.faces = mesh.faces;
  data.uvs = mesh.uvs;
  data.uv_faces = mesh.uv_faces;
  data.camera_ids = {"a"};
  data.centers = Points::Zero(1, 3);
  data.widths = data.heights = {kSide};
  SurfaceFrame frame = surface_frame(mesh.vertices, mesh.faces, mesh.uvs, mesh.uv_faces);
  frame.transfer.setConstant(mesh.vertices.rows(), 2 * kTransferTerms, 0.7F);
  data.frames = {frame};
  AppearanceView view;
  view.pixel = {0};
  view.u = view.v = {0.5F};
  view.colors = {120, 80, 60};
  data.views = {view};
  NetworkOptions options;
  options.resolution = one.texels;
  options.channels = one.channels;
  options.shading = one.shading;
  auto model = std::make_shared<AppearanceModel>(initial_model(data, options, 1));
  for (auto& [name, tensor] : model->parameters) {
    if (name.ends_with(".last.g")) {
      tensor = tensor_of(std::vector<float>(tensor.data.size() / 4, 0.1F), tensor.shape);
    }
  }
  return model;
}

/// Milliseconds of one image, as a whole and of its parts: medians of some.
struct Times {
  double all;
  PaintTimes parts;
};

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Times paint(const Case& one, Device device, int pictures) {
  const Mesh body = tube(0.2);
  const Mesh garment = tube(0.25);
  PaintOptions options;
  options.samples = one.samples;
  options.occlusion.strata = one.strata;
  Painter painter({{body.faces, model_of(body, one)}, {garment.faces, model_of(garment, one)}},
                  options, device);
  Camera camera;
  camera.id = "front";
  camera.width = camera.height = kSide;
  camera.fx = camera.fy = 1.5 * kSide;
  camera.cx = camera.cy = 0.5 * kSide;
  camera.camera_from_world_rotation << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  camera.camera_from_world_translation = {0, 0.8, 3};
  std::vector<double> whole;
  std::vector<PaintTimes> parts;
  for (int i = 0; i < 2 * pictures + 1; ++i) {
    Points moved = garment.vertices;
    moved.col(1).array() += 1e-3 * std::sin(0.1 * i);
    PaintTimes times;
    const auto begin = std::chrono::steady_clock::now();
    painter.paint({body.vertices, moved}, camera, i % 2 == 1 ? &times : nullptr);
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
    if (i % 2 == 1) {
      parts.push_back(times);
    } else if (i > 0) {  // the first one takes memory and loads kernels
      whole.push_back(took.count());
    }
  }
  Times result = {median(whole), {}};
  for (double PaintTimes::*part :
       {&PaintTimes::look, &PaintTimes::surfaces, &PaintTimes::networks, &PaintTimes::picture}) {
    std::vector<double> values;
    values.reserve(parts.size());
    for (const PaintTimes& times : parts) {
      values.push_back(times.*part);
    }
    result.parts.*part = median(values);
  }
  return result;
}

}  // namespace
}  // namespace atelier

int main(int argc, char** argv) {
  using namespace atelier;
  const bool cuda = argc > 1 && std::strcmp(argv[1], "cuda") == 0;
  std::printf("| device | texels | channels | shading | rays a side | samples | ms | pictures/s |");
  std::printf(" look | surfaces | networks | image |\n");
  std::printf("|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  const std::vector<Case> cases =
      cuda ? std::vector<Case>{{256, 8, 2, 8, 1},   {512, 16, 4, 8, 1},  {1024, 16, 4, 4, 1},
                               {1024, 16, 4, 8, 1}, {1024, 32, 4, 8, 1}, {1024, 32, 1, 8, 1},
                               {1024, 16, 4, 8, 2}}
           : std::vector<Case>{{256, 8, 2, 8, 1}, {1024, 16, 4, 8, 2}};
  for (const Case& one : cases) {
    const Times times = paint(one, cuda ? Device::Cuda : Device::Cpu, cuda ? 40 : 3);
    std::printf("| %s | %d | %d | %d | %d | %d | %.1f | %.1f | %.2f | %.2f | %.2f | %.2f |\n",
                cuda ? "cuda" : "cpu", one.texels, one.channels, one.shading,
                one.strata * one.strata, one.samples * one.samples, times.all, 1e3 / times.all,
                times.parts.look, times.parts.surfaces, times.parts.networks, times.parts.picture);
    std::fflush(stdout);
  }
}
