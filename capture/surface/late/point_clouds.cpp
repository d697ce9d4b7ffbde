// PCL, for capture/surface/surface_from_points.cpp: a shared object of its own, since PCL brings
// VTK.
#include "capture/surface/late/point_clouds.h"

#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/point_types.h>
#include <pcl/surface/poisson.h>

namespace atelier {
namespace {

pcl::PointCloud<pcl::PointNormal>::Ptr cloud_of(const Mesh& points) {
  pcl::PointCloud<pcl::PointNormal>::Ptr cloud(new pcl::PointCloud<pcl::PointNormal>);
  for (Index i = 0; i < points.vertices.rows(); ++i) {
    pcl::PointNormal point;
    point.getVector3fMap() = points.vertices.row(i).transpose().cast<float>();
    point.getNormalVector3fMap() = points.normals.row(i).transpose().cast<float>();
    cloud->push_back(point);
  }
  return cloud;
}

}  // namespace
}  // namespace atelier

extern "C" void atelier_poisson_surface(const atelier::Mesh& points, int octree_depth,
                                        double point_weight, atelier::Mesh& surface) {
  using atelier::Index;
  pcl::Poisson<pcl::PointNormal> reconstruction;
  reconstruction.setInputCloud(atelier::cloud_of(points));
  reconstruction.setDepth(octree_depth);
  reconstruction.setPointWeight(static_cast<float>(point_weight));
  reconstruction.setThreads(1);  // the order of its sums must not depend on the machine
  pcl::PointCloud<pcl::PointNormal> vertices;
  std::vector<pcl::Vertices> polygons;
  reconstruction.performReconstruction(vertices, polygons);
  surface.vertices.resize(static_cast<Index>(vertices.size()), 3);
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    surface.vertices.row(static_cast<Index>(i)) =
        vertices[i].getVector3fMap().cast<double>().transpose();
  }
  surface.faces.resize(static_cast<Index>(polygons.size()), 3);
  for (std::size_t i = 0; i < polygons.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      surface.faces(static_cast<Index>(i), k) =
          static_cast<int>(polygons[i].vertices[static_cast<std::size_t>(k)]);
    }
  }
}

extern "C" void atelier_sound_points(const atelier::Mesh& points, int neighbours, double sigma,
                                     std::vector<int>& rows) {
  pcl::StatisticalOutlierRemoval<pcl::PointNormal> filter;
  filter.setInputCloud(atelier::cloud_of(points));
  filter.setMeanK(neighbours);
  filter.setStddevMulThresh(sigma);
  filter.filter(rows);
}
