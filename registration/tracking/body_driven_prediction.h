#pragma once

#include "registration/tracking/cloth_energy.h"

namespace atelier {

/// Rotation that takes the edges around each vertex best from one shape to another, weighted per
/// edge. Identity where no edge says anything. O(V + E).
std::vector<Eigen::Matrix3d> edge_rotations(const Edges& edges, const Eigen::VectorXd& weights,
                                            const Points& from, const Points& to);

/// The edges of a shape, each turned as its two ends have turned from there to `to`: [E,3], first
/// minus second.
Points turned_edges(const Edges& edges, const Eigen::VectorXd& weights, const Points& from,
                    const Points& to);

/// Where cloth goes that is glued to the body.
struct BodyDrivenCloth {
  Points vertices;            ///< [V,3] m
  Eigen::VectorXd distances;  ///< [V] m from the body before
};

/// Every vertex keeps its place in the frame of the body's surface next to it while the body moves
/// from one shape to another of the same topology. Throws LogicError where sizes differ.
BodyDrivenCloth body_driven(const Points& cloth, const Triangles& body_faces, const Points& body,
                            const Points& moved_body);

struct PredictOptions {
  double near = 0.06;     ///< m: cloth farther from the body follows it less
  double least = 0.03;    ///< share with which cloth far away still follows
  double rigid = 0.15;    ///< m, length over which cloth keeps its shape on the way
  double momentum = 0.5;  ///< share of what the frame before moved against the body
  double home = 0.2;      ///< share with which cloth on the body tends to its place in the template
  double body_prior = 0.03;  ///< against the scan's 1: what keeps cloth on the body from sliding
};

/// How close each vertex is to the body: 1 on it, falling with exp(-(distance / near)^2). [V]
Eigen::VectorXd closeness(const BodyDrivenCloth& ridden, double near);

/// State of cloth before a frame. Holds references only.
struct ClothBefore {
  const Points& vertices;         ///< [V,3] m, in the frame before
  const BodyDrivenCloth& ridden;  ///< where the body takes it from there
  const BodyDrivenCloth& home;    ///< where the body takes it from the template; or empty
  const Points& drift;  ///< [V,3] m, how it moved against the body in the frame before; or empty
};

/// Where cloth is likely to be: it moves with the body where it is near, keeps its shape elsewhere.
Points predicted_cloth(ShapeSolver& solver, const ClothModel& model, const ClothBefore& before,
                       const PredictOptions& options = {});

/// Weights of edges for an energy that keeps edges' vectors over a length: length^2 times about
/// half the sum of the cotangents opposite to each, m2.
Eigen::VectorXd rigid_weights(const ClothModel& model, double length);

}  // namespace atelier
