#include "core/store/unfinished_folder.h"

#include <system_error>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/store/workspace_folder.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// Without a "/" or "/." at its end.
fs::path named_place(const fs::path& out) {
  fs::path place = fs::absolute(workspace_place(out));
  while (!place.has_filename() || place.filename() == ".") {
    place = place.parent_path();
  }
  return place;
}

}  // namespace

UnfinishedFolder::UnfinishedFolder(const fs::path& out)
    : place_(named_place(out)),
      folder_(place_.parent_path() / ("." + place_.filename().string() + ".unfinished")),
      above_(folder_) {
  make_private_directory(folder_);
  lock_ = FileLock::try_lock_folder(folder_, FileLock::Mode::Exclusive);
  if (!lock_) {
    throw EnvironmentError(folder_.string(),
                           "another run is writing it; wait for that, or choose another folder");
  }
  fs::remove_all(content());
}

UnfinishedFolder::~UnfinishedFolder() {
  if (lock_) {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
    above_.remove_empty();
  }
}

void UnfinishedFolder::finish() const {
  fs::rename(content(), place_);
  sync_directory(place_.parent_path());
}

}  // namespace atelier
