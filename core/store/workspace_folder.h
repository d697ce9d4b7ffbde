#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "core/store/stage.h"

namespace atelier {

/// Why a folder may not become a workspace, as a sentence's end: "it holds capture.toml, images and
/// 3 more, and no stage's results". "" if it may: where it is missing, where nothing lies in it but
/// hidden files and what a disk begins with (lost+found), and where a stage has a folder already.
/// Throws EnvironmentError if it cannot be looked at.
std::string workspace_problem(std::span<const Stage> stages,
                              const std::filesystem::path& workspace);

/// "others may look into work (mode 0755): chmod 700 work closes it", if more than its owner may
/// read, write or enter the folder; "" if not, or if there is none. Results in it are made for the
/// owner alone at any rate; a folder's own mode is left as its maker wished it.
std::string openness_of(const std::filesystem::path& workspace);

}  // namespace atelier
