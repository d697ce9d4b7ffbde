#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace atelier {

/// Files and folders that an option's text names: all of it, else its parts between commas or plus
/// signs, or what stands behind their first "=" or ":" ("upper=tee.obj, lower=skirt.obj",
/// "tee+skirt.json"). Nothing for words. Throws EnvironmentError as `file_kind`.
std::vector<std::filesystem::path> files_named_in(const std::string& text);

}  // namespace atelier
