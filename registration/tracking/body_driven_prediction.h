#pragma once

#include "registration/tracking/cloth_energy.h"

namespace atelier {

/// Rotation that best aligns the edges around each vertex of one shape with those of another,
/// weighted per edge. Identity where all weights are 0. O(V + E).
std::vector<Eigen::Matrix3d> edge_rotations(const Edges& edges, const Eigen::VectorXd& weights,
                                            const Points& from, const Points& to);

/// The edges of a shape, each turned as its two ends have turned from there to `to`: [E,3], first
/// minus second.
Points turned_edges(const Edges& edges, const Eigen::VectorXd& weights, const Points& from,
                    const Points& to);

/// Cloth as if glued to the body.
struct BodyDrivenCloth {
  Points vertices;            ///< [V,3] m
  Eigen::VectorXd distances;  ///< [V] m, from the body before its motion
};

/// Every vertex keeps its position in the frame of the nearest body surface while the body moves
/// from one shape to another of the same topology. Throws LogicError where sizes differ.
BodyDrivenCloth body_driven(const Points& cloth, const Triangles& body_faces, const Points& body,
                            const Points& moved_body);

struct PredictOptions {
  double near = 0.06;     ///< m, distance beyond which cloth follows the body less
  double least = 0.03;    ///< fraction by which distant cloth still follows
  double rigid = 0.15;    ///< m, length over which cloth keeps its shape
  double momentum = 0.5;  ///< fraction of the last motion relative to the body that continues
  double home = 0.2;  ///< fraction by which cloth on the body returns to its place in the template
  double body_prior = 0.03;  ///< weight against sliding on the body, relative to the scan at 1
};

/// How close each vertex is to the body: 1 on it, falling with exp(-(distance / near)^2). [V]
Eigen::VectorXd closeness(const BodyDrivenCloth& driven, double near);

/// State of cloth before a frame. Holds references only.
struct ClothBefore {
  const Points& vertices;         ///< [V,3] m, in the frame before
  const BodyDrivenCloth& driven;  ///< body-driven prediction from there
  const BodyDrivenCloth& home;    ///< the same from the template; or empty
  const Points& drift;            ///< [V,3] m, its last motion relative to the body; or empty
};

/// Predicted cloth: moves with the body where it is near, keeps its shape elsewhere.
Points predicted_cloth(ShapeSolver& solver, const ClothModel& model, const ClothBefore& before,
                       const PredictOptions& options = {});

/// Weights of edges for an energy that keeps edges' vectors over a length: length^2 times about
/// half the sum of the cotangents opposite to each, m2.
Eigen::VectorXd rigid_weights(const ClothModel& model, double length);

}  // namespace atelier
