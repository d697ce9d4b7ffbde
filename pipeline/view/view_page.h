#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>

#include "core/options.h"
#include "pipeline/view/view_scene.h"

namespace atelier {

struct ViewPageOptions {
  int image_width = 1280;  ///< px, largest of the cameras' images; larger ones are reduced
};
OptionTable describe(ViewPageOptions& options);

/// A file of a page, made when it is asked for, from any thread.
struct ViewFile {
  std::string type;                    ///< "text/javascript; charset=utf-8"
  std::function<std::string()> bytes;  ///< empty: those of `path`
  std::filesystem::path path;
};

/// The files of a page by their names, of [a-z0-9._/-]: "index.html", "data/0/3.js". They are the
/// same for a server and for a folder; no name of a file of the user's is in one.
using ViewPage = std::map<std::string, ViewFile>;

/// Puts a script of data (view_data.h) on the page: the file `key`.js, which `make` makes.
void put_data(ViewPage& page, const std::string& key,
              std::function<std::string(const std::string& key)> make);

/// The page of a scene. Opens no frame: a frame that cannot be read is said by the file that would
/// hold it. Throws LogicError for a scene without timelines.
ViewPage view_page(ViewScene scene, const ViewPageOptions& options = {});

}  // namespace atelier
