// Configuring on machines that lack packages: what cannot be built is left out, one line each.
#include <array>
#include <cstdio>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

struct Output {
  int code = 0;
  std::string text;
};

Output run(const std::string& command) {
  Output output;
  FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  std::array<char, 4096> buffer{};
  while (const std::size_t count = fread(buffer.data(), 1, buffer.size(), pipe)) {
    output.text.append(buffer.data(), count);
  }
  output.code = pclose(pipe);
  return output;
}

Output configure(const fixtures::TemporaryDirectory& folder, const std::string& flags) {
  return run("cmake -G Ninja -S '" + fixtures::source_directory().string() + "' -B '" +
             (folder / "build").string() + "' " + flags);
}

bool has_target(const fixtures::TemporaryDirectory& folder, const std::string& target) {
  return run("ninja -C '" + (folder / "build").string() + "' -t query lib" + target + ".a").code ==
         0;
}

/// Flags that hide every package but Eigen, HDF5, CUDA and libtorch.
std::string without_packages() {
  std::string flags = "-DTINYGLTF_INCLUDE=no -DTINYGLTF_LIBRARY= -DCGAL_INCLUDE= -DPCL_INCLUDE=";
  for (const char* package : {"TBB", "OpenCV", "PkgConfig", "nlohmann_json", "CLI11", "spdlog",
                              "embree", "GTest", "benchmark", "Ceres", "JPEG", "PNG"}) {
    flags += std::string(" -DCMAKE_DISABLE_FIND_PACKAGE_") + package + "=ON";
  }
  return flags;
}

TEST(Configure, OnlyEigenAndHdf5_BuildCoreAndSimulation) {
  const fixtures::TemporaryDirectory folder;
  const Output output = configure(folder, "-DATELIER_CUDA=OFF " + without_packages());
  ASSERT_EQ(output.code, 0) << output.text;
  EXPECT_NE(output.text.find("left out: core_io (missing:"), std::string::npos) << output.text;
  EXPECT_NE(output.text.find("left out: atelier (missing:"), std::string::npos) << output.text;
  EXPECT_NE(output.text.find("left out: tests (missing: GoogleTest)"), std::string::npos);
  EXPECT_TRUE(has_target(folder, "core"));
  EXPECT_TRUE(has_target(folder, "simulation"));
  EXPECT_TRUE(has_target(folder, "appearance"));
  EXPECT_FALSE(has_target(folder, "core_io"));
}

TEST(Configure, OnlyCudaAndLibtorch_BuildTwinsAndNetworks) {
  std::string nvcc = run("command -v nvcc || ls /usr/local/cuda/bin/nvcc").text;
  nvcc = nvcc.substr(0, nvcc.find('\n'));
  if (!std::filesystem::exists(nvcc)) {
    GTEST_SKIP() << "no nvcc here";
  }
  const fixtures::TemporaryDirectory folder;
  const Output output = configure(
      folder, "-DATELIER_CUDA=ON -DCMAKE_CUDA_COMPILER='" + nvcc + "' " + without_packages());
  ASSERT_EQ(output.code, 0) << output.text;
  EXPECT_NE(output.text.find("left out: core_io (missing:"), std::string::npos) << output.text;
  EXPECT_TRUE(has_target(folder, "core"));
  EXPECT_TRUE(has_target(folder, "simulation"));
  EXPECT_NE(run("ninja -C '" + (folder / "build").string() + "' -t inputs libsimulation.a")
                .text.find(".cu.o"),
            std::string::npos);
  if (output.text.find("left out: appearance_network (missing: torch)") != std::string::npos) {
    GTEST_SKIP() << "no libtorch here: without the networks";
  }
  EXPECT_TRUE(has_target(folder, "appearance_network")) << output.text;
  // The program that trains asks for nlohmann-json besides, which is hidden here, and for no more.
  EXPECT_NE(output.text.find("left out: appearance_training (missing: core_tensors)"),
            std::string::npos)
      << output.text;
}

TEST(ConfigureRefused, DependencyWithoutPublicOrPrivate_IsRefused) {
  const fixtures::TemporaryDirectory folder;
  const std::string lists = (folder / "CMakeLists.txt").string();
  FILE* file = fopen(lists.c_str(), "w");
  const std::string text =
      "cmake_minimum_required(VERSION 3.24)\nproject(x CXX)\ninclude(\"" +
      fixtures::source_directory().string() +
      "/cmake/Targets.cmake\")\natelier_library(part DIRECTORY part Eigen3::Eigen)\n";
  fputs(text.c_str(), file);
  fclose(file);
  const Output output =
      run("cmake -S '" + folder.path().string() + "' -B '" + (folder / "build").string() + "'");
  EXPECT_NE(output.code, 0);
  EXPECT_NE(output.text.find("say PUBLIC or PRIVATE"), std::string::npos) << output.text;
}

}  // namespace
}  // namespace atelier
