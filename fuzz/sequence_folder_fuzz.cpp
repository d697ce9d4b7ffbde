#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <new>
#include <string>
#include <string_view>

#include <unistd.h>

#include "core/io/sequence_folder.h"
#include "fuzz/reader.h"

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// A folder of its own, gone when it is left.
class Folder {
 public:
  Folder() {
    std::string name = (fs::temp_directory_path() / "atelier-fuzz-XXXXXX").string();
    path_ = mkdtemp(name.data()) == nullptr ? "" : name;
  }
  ~Folder() {
    std::error_code ignored;
    try {
      fs::remove_all(path_, ignored);
    } catch (const std::bad_alloc&) {  // in that of test_out_of_memory; then there is some again
      fs::remove_all(path_, ignored);
    }
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

/// What a line asks for: "name/" a folder, "name > target" a link, else a file with a triangle in
/// it. Nothing leaves the folder: what is left of a "/" is dropped.
void make(const fs::path& folder, std::string_view line) {
  const bool is_folder = line.ends_with('/');
  const std::size_t arrow = line.find(" > ");
  const std::string target(arrow == std::string_view::npos ? "" : line.substr(arrow + 3));
  line = line.substr(0, std::min(arrow, line.size() - (is_folder ? 1 : 0)));
  const std::string name(line.substr(line.rfind('/') + 1));
  if (name.empty() || name == "." || name == ".." || name.size() > 200 ||
      name.find('\0') != std::string::npos || target.find('/') != std::string::npos) {
    return;
  }
  std::error_code ignored;
  if (is_folder) {
    fs::create_directory(folder / name, ignored);
  } else if (!target.empty()) {
    fs::create_symlink(target, folder / name, ignored);
  } else {
    std::ofstream(folder / name) << kTriangle;
  }
}

}  // namespace

/// The bytes are the listing of a folder, a line for each thing in it; every frame is read.
ATELIER_FUZZ_READER(sequence_folder) {
  constexpr int kThings = 20;
  const Folder folder;
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  for (int i = 0; i < kThings && !text.empty(); ++i) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    if (end > 0) {
      make(folder.path(), text.substr(0, end));
    }
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  const atelier::Sequence sequence = atelier::read_sequence_folder(folder.path());
  for (std::size_t i = 0; i < sequence.frame_ids.size(); ++i) {
    ATELIER_CHECK(sequence.frame_ids[i] >= 0, "a frame below 0");
    ATELIER_CHECK(i == 0 || sequence.frame_ids[i] > sequence.frame_ids[i - 1],
                  "frames out of order");
    const atelier::Mesh mesh = sequence.load(static_cast<atelier::Index>(i));
    ATELIER_CHECK(mesh.vertices.rows() == 3, "another mesh than the file holds");
  }
}
