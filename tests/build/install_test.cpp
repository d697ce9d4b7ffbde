// What cmake --install and cpack take: a prefix that works wherever it is moved, programs that link
// it, Debian's package.
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

struct ShellOutput {
  int code = 0;
  std::string text;  ///< of both streams
};

/// Runs a line of the shell, without the environment that a build may have set.
ShellOutput shell(const std::string& line) {
  ShellOutput output;
  FILE* pipe = popen(("unset LD_LIBRARY_PATH DESTDIR; exec 2>&1; " + line).c_str(), "r");
  std::array<char, 4096> buffer{};
  while (const std::size_t count = fread(buffer.data(), 1, buffer.size(), pipe)) {
    output.text.append(buffer.data(), count);
  }
  output.code = pclose(pipe);
  return output;
}

std::string word(const fs::path& path) {
  return "'" + path.string() + "'";
}

bool has_program(const std::string& name) {
  return shell("command -v " + name).code == 0;
}

fs::path build_folder() {
  return fs::path(fixtures::program_path()).parent_path().parent_path();
}

/// A value of the build's cache, "" where it has none.
std::string cached(const std::string& name) {
  std::ifstream cache(build_folder() / "CMakeCache.txt");
  for (std::string line; std::getline(cache, line);) {
    if (line.starts_with(name + ":")) {
      return line.substr(line.find('=') + 1);
    }
  }
  return "";
}

/// The first words of the rows of a help's stages and commands.
std::vector<std::string> commands_of(const std::string& help) {
  std::vector<std::string> commands;
  std::istringstream lines(help.substr(0, help.find("Exit codes:")));
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("  ")) {
      commands.push_back(line.substr(2, line.find(' ', 2) - 2));
    }
  }
  return commands;
}

/// One installation for all tests, which has been moved since.
class Install : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (fixtures::program_path().empty()) {
      return;
    }
    folder_ = new fixtures::TemporaryDirectory;
    const fs::path first = *folder_ / "first";
    log_ = shell("cmake --install " + word(build_folder()) + " --prefix " + word(first));
    if (log_.code == 0) {
      fs::create_directory(*folder_ / "moved here");
      fs::rename(first, prefix());
    }
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }
  void SetUp() override {
    if (folder_ == nullptr) {
      GTEST_SKIP() << "this build has no program";
    }
    ASSERT_EQ(log_.code, 0) << log_.text;
  }

  static const fixtures::TemporaryDirectory& folder() { return *folder_; }
  static fs::path prefix() { return *folder_ / "moved here" / "prefix"; }
  static std::string program() { return word(prefix() / "bin/atelier"); }

  /// A tetrahedron of 1 m as OBJ.
  static fs::path small_mesh() {
    const fs::path file = folder() / "mesh.obj";
    std::ofstream(file) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
                           "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    return file;
  }

 private:
  static inline fixtures::TemporaryDirectory* folder_ = nullptr;
  static inline ShellOutput log_;
};

TEST_F(Install, Prefix_HasProgramsLibrariesHeadersAndPages) {
  for (const char* file :
       {"bin/atelier", "lib/atelier/libcore.a", "lib/atelier/libsimulation.a",
        "lib/cmake/Atelier/AtelierConfig.cmake", "lib/cmake/Atelier/AtelierConfigVersion.cmake",
        "include/atelier/core/mesh.h", "include/atelier/core/io/mesh_file.h",
        "include/atelier/simulation/solver.h", "share/man/man1/atelier.1.gz",
        "share/doc/atelier/LICENSE"}) {
    EXPECT_TRUE(fs::is_regular_file(prefix() / file)) << file;
  }
  std::set<std::string> late;
  for (const auto& entry : fs::directory_iterator(build_folder() / "lib")) {
    if (entry.path().extension() == ".so") {
      late.insert(entry.path().filename().string());
    }
  }
  EXPECT_FALSE(late.empty());
  for (const std::string& library : late) {
    EXPECT_TRUE(fs::is_regular_file(prefix() / "lib/atelier" / library)) << library;
  }
  for (const char* absent : {"include/atelier/apps", "include/atelier/pipeline", "include/core",
                             "share/man/man1/atelier.1", "lib/libcore.a"}) {
    EXPECT_FALSE(fs::exists(prefix() / absent)) << absent;
  }
}

TEST_F(Install, PackageFiles_NameNeitherSourcesNorBuild) {
  const ShellOutput found =
      shell("cd " + word(prefix()) + " && grep -rlF -e " + word(build_folder()) + " -e " +
            word(folder() / "first") + " lib/cmake share");
  EXPECT_NE(found.code, 0) << found.text;
}

TEST_F(Install, MovedProgram_FindsItsLateLibraries) {
  EXPECT_THAT(shell(program() + " --version").text, HasSubstr("atelier "));
  const fs::path mesh = small_mesh();
  // Through a link, and with a format whose library is loaded late.
  fs::create_symlink(prefix() / "bin/atelier", folder() / "linked");
  fs::create_directory_symlink(prefix() / "bin", folder() / "programs");
  for (const fs::path& called :
       {prefix() / "bin/atelier", folder() / "linked", folder() / "programs/atelier"}) {
    const fs::path image = folder() / (called.parent_path().filename().string() + ".webp");
    const ShellOutput drawn = shell(word(called) + " render " + word(mesh) +
                                    " --width 32 --height 32 --samples 1 --out " + word(image));
    ASSERT_EQ(drawn.code, 0) << drawn.text;
    EXPECT_GT(fs::file_size(image), 0U);
  }
  // Nothing else would have: the build's own are not looked for.
  const fs::path away = prefix() / "lib/atelier.away";
  fs::rename(prefix() / "lib/atelier", away);
  const ShellOutput refused =
      shell(program() + " render " + word(mesh) + " --out " + word(folder() / "no.webp"));
  fs::rename(away, prefix() / "lib/atelier");
  EXPECT_NE(refused.code, 0);
  EXPECT_THAT(refused.text, HasSubstr("it belongs in lib/atelier beside the program's bin"));
}

TEST_F(Install, Completion_KnowsTheProgram) {
  const fs::path script = prefix() / "share/bash-completion/completions/atelier";
  if (shell(program() + " --help").text.find("\n  completion ") == std::string::npos) {
    GTEST_SKIP() << "this build has no completion";
  }
  const ShellOutput completed = shell(
      "bash -c '. \"$0\"; COMP_WORDS=(atelier sim); COMP_CWORD=1; _atelier; "
      "printf \"%s\\n\" \"${COMPREPLY[@]}\"' " +
      word(script));
  EXPECT_EQ(completed.text, "simulate\n");
}

TEST_F(Install, ManPage_NamesEveryCommandAndRenders) {
  const std::string page = word(prefix() / "share/man/man1/atelier.1.gz");
  const ShellOutput source = shell("gzip -dc " + page);
  ASSERT_EQ(source.code, 0) << source.text;
  EXPECT_THAT(source.text, Not(HasSubstr("@")));
  const auto commands = commands_of(shell(program() + " --help").text);
  EXPECT_GT(commands.size(), 20U);
  for (const std::string& command : commands) {
    std::string name;
    for (const char c : command) {
      name += c == '-' ? "\\-" : std::string(1, c);
    }
    EXPECT_THAT(source.text, HasSubstr("\n.B " + name + "\n"));
  }
  if (!has_program("groff")) {
    GTEST_SKIP() << "groff is missing: the page is not rendered";
  }
  const ShellOutput rendered = shell("gzip -dc " + page + " | groff -man -Tutf8 -ww -z");
  EXPECT_EQ(rendered.text, "");
}

TEST_F(Install, Examples_BuildAndRunAgainstTheMovedPrefix) {
  std::string flags;
  if (const std::string sanitizers = cached("ATELIER_SANITIZE"); !sanitizers.empty()) {
    flags += " -fsanitize=" + sanitizers;
  }
  if (cached("ATELIER_COVERAGE") == "ON") {
    flags += " --coverage";
  }
  const fs::path build = folder() / "examples";
  const ShellOutput built =
      shell("cmake -G Ninja -S " + word(fixtures::source_directory() / "examples") + " -B " +
            word(build) + " -DCMAKE_PREFIX_PATH=" + word(prefix()) +
            " -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_FLAGS_RELEASE=-O1 -DCMAKE_CXX_COMPILER=" +
            word(cached("CMAKE_CXX_COMPILER")) + " -DCMAKE_CXX_FLAGS='-Wall -Wextra -Werror" +
            flags + "' -DCMAKE_EXE_LINKER_FLAGS='" + (has_program("mold") ? "-fuse-ld=mold" : "") +
            "' -DTORCH_ROOT=" + word(cached("TORCH_ROOT")) + " && ninja -C " + word(build));
  ASSERT_EQ(built.code, 0) << built.text;

  const auto example = [&](const std::string& name, const std::string& arguments) {
    return shell("cd " + word(folder().path()) + " && " + word(build / name) + " " + arguments);
  };
  const ShellOutput skinned = example("skin_body", "body.ply 1.8");
  EXPECT_THAT(skinned.text, HasSubstr("vertices, arm span"));
  const ShellOutput simulated = example("simulate_cloth", "");
  EXPECT_THAT(simulated.text, HasSubstr("frame 120: lowest point at 0."));
  small_mesh();
  const ShellOutput flattened = example("flatten_mesh", "mesh.obj pattern.svg");
  EXPECT_THAT(flattened.text, HasSubstr(" seams, strain of 99% of the area below "));
  EXPECT_THAT(shell("head -c 500 " + word(folder() / "pattern.svg")).text, HasSubstr("<svg"));
  const ShellOutput registered = example("register_frame", "");
  EXPECT_THAT(registered.text, HasSubstr(" m, after 0.00"));

  if (fs::exists(build / "read_capture")) {
    // A nerfstudio capture; its first image needs a library that is loaded late.
    fs::create_directory(folder() / "capture");
    std::string frames;
    for (const char* image : {"0.webp", "1.png"}) {
      const ShellOutput drawn =
          shell(program() + " render " + word(small_mesh()) +
                " --width 32 --height 32 --samples 1 --out " + word(folder() / "capture" / image));
      ASSERT_EQ(drawn.code, 0) << drawn.text;
      frames += std::string(frames.empty() ? "" : ",") + R"({"file_path": ")" + image +
                R"(", "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,3],[0,0,0,1]]})";
    }
    std::ofstream(folder() / "capture/transforms.json")
        << R"({"fl_x": 40, "fl_y": 40, "cx": 16, "cy": 16, "w": 32, "h": 32, "frames": [)" << frames
        << "]}";
    const ShellOutput read = example("read_capture", "capture");
    EXPECT_EQ(read.code, 0) << read.text;
    EXPECT_THAT(read.text, HasSubstr("layout nerfstudio, 2 frames"));
    EXPECT_THAT(read.text, HasSubstr(" on average"));
  } else {
    EXPECT_THAT(built.text, HasSubstr("left out: read_capture (missing: "));
  }
  if (fs::exists(build / "draw_with_network")) {
    const ShellOutput drawn = example("draw_with_network", "drawn.png 5");
    EXPECT_EQ(drawn.code, 0) << drawn.text;
    EXPECT_THAT(drawn.text, HasSubstr("drawn in drawn.png"));
  } else {
    EXPECT_THAT(built.text, HasSubstr("left out: draw_with_network (missing: "));
  }
}

TEST_F(Install, UnknownComponent_IsRefusedByItsName) {
  const fs::path sources = folder() / "unknown";
  fs::create_directory(sources);
  std::ofstream(sources / "CMakeLists.txt")
      << "cmake_minimum_required(VERSION 3.24)\nproject(x CXX)\n"
         "find_package(Atelier REQUIRED COMPONENTS core knitting)\n";
  const ShellOutput output = shell("cmake -S " + word(sources) + " -B " + word(sources / "build") +
                                   " -DCMAKE_PREFIX_PATH=" + word(prefix()));
  EXPECT_NE(output.code, 0);
  EXPECT_THAT(output.text, HasSubstr("knitting: missing: not in this installation"));
}

TEST_F(Install, DebianPackage_HasTheProgramAndSaysWhatItNeeds) {
  if (!has_program("dpkg-deb") || !has_program("dpkg-shlibdeps")) {
    GTEST_SKIP() << "dpkg-dev is missing";
  }
  const fs::path out = folder() / "package";
  const ShellOutput packed = shell("cpack --config " + word(build_folder() / "CPackConfig.cmake") +
                                   " -G DEB -B " + word(out) + " -D CPACK_COMPONENTS_ALL=program");
  ASSERT_EQ(packed.code, 0) << packed.text;
  const ShellOutput listed = shell("dpkg-deb -c " + word(out) + "/atelier_*.deb");
  for (const char* file :
       {"./usr/bin/atelier\n", "./usr/lib/atelier/libatelier_pictures.so\n",
        "./usr/share/man/man1/atelier.1.gz\n", "./usr/share/doc/atelier/LICENSE\n",
        "./usr/share/bash-completion/completions/atelier\n"}) {
    EXPECT_THAT(listed.text, HasSubstr(file));
  }
  EXPECT_THAT(listed.text, Not(HasSubstr("libcore.a")));
  const ShellOutput fields = shell("dpkg-deb -f " + word(out) + "/atelier_*.deb");
  EXPECT_THAT(fields.text, HasSubstr("Package: atelier\n"));
  EXPECT_THAT(fields.text, HasSubstr("libhdf5"));
  EXPECT_THAT(fields.text, HasSubstr("libc6"));
}

}  // namespace
}  // namespace atelier
