#pragma once

#include <Eigen/Core>
#include <vector>

#include "registration/tracking/photometric.h"

namespace atelier {

/// Reads a print that is nowhere alike as a code: the colours around a place say which place of
/// the cloth it is, however far it has slid, so that they are correspondences that need no start
/// (Halimi et al., "Pattern-based cloth registration and sparse-view animation", 2022). Theirs
/// reads single cells; here all of a patch is one descriptor, compared as a whole, so that cells of
/// three pixels are enough, and nothing is asked of the print but that no two places of it agree.
/// Descriptors are of hue alone: neither shade nor exposure is in them, and cloth of one hue has
/// none.

struct CodeOptions {
  double spacing = 0.0025;  ///< m between points whose colours are taken
  double place = 0.006;     ///< m between places that are told apart
  double site = 0.03;       ///< m between places that are read
  double reach = 0.15;      ///< m, how far cloth may have slid
  double contrast = 0.05;   ///< least deviation of hue in a descriptor, of full saturation's 1
  double least = 0.6;       ///< correlation of a descriptor with its place
  double margin = 0.15;     ///< by which the next best place correlates less
};

/// The descriptors of all places of a garment, from the template's frame.
struct PrintedCodebook {
  CodeOptions options;
  ClothSamples samples;
  Points rest;              ///< [N,3] m, of places, where the garment was
  std::vector<int> places;  ///< [N] samples
  std::vector<int> sites;   ///< [M] of places, that are read
  std::vector<int> points;  ///< [N, rings x directions] samples around each place; -1: no cloth
  Eigen::MatrixXf
      descriptors;  ///< [D,N] unit length, or 0 where nothing is told; no columns: no code
};

/// The print of a garment, of where it is in a frame. Empty where the print has no hues, and on
/// images without colour.
PrintedCodebook printed_codebook(const ViewedCloth& cloth, const CodeOptions& options = {});

/// One place of the cloth, seen.
struct CodeMatch {
  int face = 0;  ///< of the garment: which of its points was read
  Eigen::Vector3d barycentric = Eigen::Vector3d::Zero();
  int seen_face = 0;  ///< where the estimate has what was read
  Eigen::Vector3d seen_barycentric = Eigen::Vector3d::Zero();
  double correlation = 0;  ///< with the descriptor of that point
};

struct CodeMatches {
  std::vector<CodeMatch> kept;
  int contradicted = 0;  ///< matches whose neighbours read otherwise; they are not kept
};

/// Matches the code at the estimated garment: its x is where cameras' colours are taken, and may be
/// off along the surface by the code's reach. A match counts if its descriptor agrees, no other
/// place within reach agrees nearly as well, and most matches around it have gone the same way.
CodeMatches match_code(const PrintedCodebook& code, const ViewedCloth& cloth);

/// Rows that pull points that were read to where they were seen, along the surface.
/// @param weight  against the scan's 1
std::vector<SurfaceRow> code_rows(const PrintedCodebook& code, const CodeMatches& matches,
                                  const Topology& topology, const Points& x, double weight);

}  // namespace atelier
