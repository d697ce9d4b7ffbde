#pragma once

#include <span>
#include <string_view>

namespace atelier {

/// A file of the page that is the same for every scene: markup, style, scripts. From the folder
/// `viewer`, compiled into the program, so that an installed one finds them from any prefix.
struct ViewAsset {
  std::string_view name;  ///< "index.html"
  std::string_view type;  ///< "text/html; charset=utf-8"
  std::string_view bytes;
};

std::span<const ViewAsset> view_assets();

}  // namespace atelier
