// Files of absurd sizes cost neither time nor memory: sparse files, refused by their size or
// header.

#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include "core/archive.h"
#include "core/error.h"
#include "core/io/foreign_hdf5.h"
#include "core/io/image_file.h"
#include "core/io/json.h"
#include "core/io/mesh_file.h"
#include "core/io/npy.h"
#include "core/io/npz.h"
#include "core/io/safetensors.h"
#include "core/io/sequence_folder.h"
#include "core/io/toml.h"
#include "core/sequence_archive.h"
#include "tests/support/leave.h"
#include "tests/support/refusals.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// A file that begins with `start` and is zeros up to `bytes`, which take no place on the disk.
fs::path sparse_file(const fs::path& path, std::int64_t bytes, std::string_view start = "") {
  std::ofstream(path, std::ios::binary) << start;
  fs::resize_file(path, static_cast<std::uintmax_t>(bytes));
  return path;
}

/// What a reader says to a file one byte larger than it takes.
std::string file_size_refusal(const char* name, std::int64_t ceiling,
                              const std::function<void(const fs::path&)>& read) {
  const fixtures::TemporaryDirectory folder;
  try {
    read(sparse_file(folder.path() / name, ceiling + 1));
  } catch (const DataError& error) {
    return error.expected;
  }
  return "was read";
}

std::string at_most(std::int64_t bytes) {
  return "at most " + std::to_string(bytes) + " bytes";
}

TEST(FileSize, FileBeyondSizeLimit_IsRefusedByEveryReader) {
  const Limits limits;
  for (const char* name : {"a.obj", "a.ply", "a.gltf", "a.glb"}) {
    EXPECT_EQ(file_size_refusal(name, limits.mesh_file_bytes,
                                [](const fs::path& path) { read_mesh(path); }),
              at_most(limits.mesh_file_bytes))
        << name;
  }
  for (const char* name : {"a.png", "a.jpg", "a.avif"}) {
    EXPECT_EQ(file_size_refusal(name, limits.image_file_bytes,
                                [](const fs::path& path) { read_image(path); }),
              at_most(limits.image_file_bytes))
        << name;
  }
  EXPECT_EQ(file_size_refusal("a.json", limits.text_file_bytes,
                              [](const fs::path& path) { read_json(path); }),
            at_most(limits.text_file_bytes));
  EXPECT_EQ(file_size_refusal("a.toml", limits.text_file_bytes,
                              [](const fs::path& path) { read_toml(path); }),
            at_most(limits.text_file_bytes));
  EXPECT_EQ(
      file_size_refusal("a.npy", limits.tensor_bytes, [](const fs::path& path) { read_npy(path); }),
      at_most(limits.tensor_bytes));
  EXPECT_EQ(file_size_refusal("a.safetensors", limits.tensor_bytes,
                              [](const fs::path& path) { read_safetensors(path); }),
            at_most(limits.tensor_bytes));
  EXPECT_EQ(file_size_refusal("a.h5", limits.tensor_bytes,
                              [](const fs::path& path) { read_archive(path, "atelier.mesh", 1); }),
            at_most(limits.tensor_bytes));
  EXPECT_EQ(file_size_refusal("a.h5", limits.tensor_bytes,
                              [](const fs::path& path) { archive_contents(path); }),
            at_most(limits.tensor_bytes));
}

TEST(FileSize, SequenceFrameBeyondSizeLimit_IsRefused) {
  const fixtures::TemporaryDirectory folder;
  const fs::path path = sparse_file(folder.path() / "frame_1.obj", 100);
  const Sequence sequence = read_sequence_folder(folder.path());
  fs::resize_file(path, static_cast<std::uintmax_t>(Limits{}.mesh_file_bytes) + 1);
  ATELIER_EXPECT_REFUSED(sequence.load(0), DataError, "at most");
  ATELIER_EXPECT_REFUSED(read_sequence_folder(folder.path()), DataError, "at most");
}

// Mapped, not read: its pages come only where HDF5 looks.
TEST(FileSize, HugeForeignHdf5_IsLeftToTheWorker) {
  const fixtures::TemporaryDirectory folder;
  const fs::path path = sparse_file(folder.path() / "a.h5", 15LL << 30);
  EXPECT_THROW(foreign_hdf5_contents(path), DataError);
}

// Sanitizers map more than any such limit.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
/// Refusals under a limit of memory that is far below the file's size.
class HugeFile : public ::testing::Test {
 protected:
  /// Expects that `read` refuses the file, with 512 MB of memory to do it.
  static void expect_refused(const fs::path& path, const std::function<void()>& read) {
    EXPECT_EXIT(read_with_little_memory(read), ::testing::ExitedWithCode(0), "") << path;
  }

  /// Exits with 0 if `read` throws DataError.
  [[noreturn]] static void read_with_little_memory(const std::function<void()>& read) {
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    const std::size_t most = pages * 4096 + (std::size_t{512} << 20);
    const rlimit limit{most, most};
    setrlimit(RLIMIT_AS, &limit);
    try {
      read();
    } catch (const DataError&) {
      fixtures::leave(0);
    }
    fixtures::leave(1);
  }

  fixtures::TemporaryDirectory folder_;
};

TEST_F(HugeFile, HugeFileOfZeros_IsRefusedByHeader) {
  constexpr std::int64_t kHuge = 15LL << 30;
  const fs::path npy = sparse_file(folder_.path() / "a.npy", kHuge);
  expect_refused(npy, [&] { read_npy(npy); });
  const fs::path safetensors = sparse_file(folder_.path() / "a.safetensors", kHuge);
  expect_refused(safetensors, [&] { read_safetensors(safetensors); });
  const fs::path npz = sparse_file(folder_.path() / "a.npz", kHuge);
  expect_refused(npz, [&] { const Npz zip(npz); });
  const fs::path archive = sparse_file(folder_.path() / "a.h5", kHuge);
  expect_refused(archive, [&] { read_archive(archive, "atelier.mesh", 1); });
}

TEST_F(HugeFile, HugeFileWithSmallHeader_IsRefusedUnread) {
  constexpr std::int64_t kHuge = 15LL << 30;
  std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3)}\n";
  std::string npy_start("\x93NUMPY\x01\x00", 8);
  npy_start += static_cast<char>(header.size());
  npy_start += '\0';
  npy_start += header;
  const fs::path npy = sparse_file(folder_.path() / "a.npy", kHuge, npy_start);
  expect_refused(npy, [&] { read_npy(npy); });
  header = R"({"a":{"dtype":"F32","shape":[2],"data_offsets":[0,8]}})";
  std::string start(8, '\0');
  start[0] = static_cast<char>(header.size());
  start += header;
  const fs::path safetensors = sparse_file(folder_.path() / "a.safetensors", kHuge, start);
  expect_refused(safetensors, [&] { read_safetensors(safetensors); });
}
#endif

}  // namespace
}  // namespace atelier
