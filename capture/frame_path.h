#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <utility>

namespace atelier {

/// Path of a frame's file. A capture has millions of them, and fs::path keeps each of its parts,
/// some 700 bytes a file: here the files of a folder share its text.
class FramePath {
 public:
  FramePath() = default;
  /// Implicit: as good as the path itself.
  FramePath(const std::filesystem::path& path)  // NOLINT(google-explicit-constructor)
      : name_(path.string()) {}
  /// A file of a folder whose text many share.
  FramePath(std::shared_ptr<const std::string> folder, std::string name)
      : folder_(std::move(folder)), name_(std::move(name)) {}

  operator std::filesystem::path() const {  // NOLINT(google-explicit-constructor)
    return folder_ ? std::filesystem::path(*folder_) / name_ : std::filesystem::path(name_);
  }
  std::string string() const { return std::filesystem::path(*this).string(); }
  bool empty() const { return !folder_ && name_.empty(); }
  bool operator==(const FramePath& other) const {
    return folder_ == other.folder_ ? name_ == other.name_ : string() == other.string();
  }

 private:
  std::shared_ptr<const std::string> folder_;  ///< none: `name_` is the whole path
  std::string name_;
};

}  // namespace atelier
