#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace atelier {

/// A run of the program of the method's authors (Ly et al. 2020) on the scene of this file: a sheet
/// of 1 m and 10,000 vertices that falls on a ball and slides off it, a spring of one stiffness on
/// every edge, a bend at every inner vertex.
struct AuthorsRun {
  int iterations = 10;        ///< of a step
  bool self_contact = false;  ///< of the cloth
};

/// Writes scene.json and sheet.obj to a new folder, for the program to be run there. Throws
/// std::runtime_error where they cannot be written.
void write_authors_scene(const std::filesystem::path& folder, const AuthorsRun& run);

/// Prints a row for each folder of a scene in which the program has run (it has data0 of it, with
/// positions of 17 digits), and rows of ours on the same cloth: time of a step, what is left of
/// Coulomb's law and of momentum, by the same measure. Throws std::runtime_error for a folder
/// without such a run.
void print_authors_runs(const std::vector<std::string>& folders);

}  // namespace atelier
