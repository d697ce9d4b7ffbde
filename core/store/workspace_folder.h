#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "core/store/stage.h"

namespace atelier {

/// Why a folder may not become a workspace, as a sentence's end: "it holds capture.toml, images and
/// 3 more, and no stage's results". "" if it may: where it is missing, where nothing lies in it but
/// hidden files and what a disk begins with (lost+found), and where a stage has a folder already.
/// Judged is the folder that the name leads to (`workspace_place`).
/// Throws EnvironmentError if it cannot be looked at.
std::string workspace_problem(std::span<const Stage> stages,
                              const std::filesystem::path& workspace);

/// The place that a workspace's name leads to: "." for "new/..", which would make `new` on its way
/// and end in a folder that was never judged. A name that leads to something, or nowhere but down,
/// stays as it is. Throws EnvironmentError if it cannot be looked at.
std::filesystem::path workspace_place(const std::filesystem::path& workspace);

/// "atelier unseal p.sealed FOLDER --identity KEY opens it", where a sealed file is in the place of
/// a workspace; "" else. Throws EnvironmentError if it cannot be looked at.
std::string unseal_advice(const std::filesystem::path& workspace);

/// "others may look into work (mode 0755): chmod 700 work closes it", if more than its owner may
/// read, write or enter the folder; "" if not, or if there is none. Results in it are made for the
/// owner alone at any rate; a folder's own mode is left as its maker wished it.
std::string openness_of(const std::filesystem::path& workspace);

}  // namespace atelier
