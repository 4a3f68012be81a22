// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/simulated_tracer.hpp"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <cstring>

#include "roslam/common/error.hpp"

namespace roslam::simulation {
namespace {

// Embree 4 renamed the context to arguments and moved the hint about coherent rays.
#if RTC_VERSION_MAJOR >= 4
void intersect_packet(const int* active, RTCScene scene, RTCRayHit8& rays) {
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect8(active, scene, &rays, &arguments);
}
void occlude_packet(const int* active, RTCScene scene, RTCRay8& rays) {
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcOccluded8(active, scene, &rays, &arguments);
}
#else
RTCIntersectContext coherent() {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}
void intersect_packet(const int* active, RTCScene scene, RTCRayHit8& rays) {
  RTCIntersectContext context = coherent();
  rtcIntersect8(active, scene, &context, &rays);
}
void occlude_packet(const int* active, RTCScene scene, RTCRay8& rays) {
  RTCIntersectContext context = coherent();
  rtcOccluded8(active, scene, &context, &rays);
}
#endif

template <typename T, typename U>
void copy(T (&to)[kPacket], const std::array<U, kPacket>& from) {
  static_assert(sizeof(T) == sizeof(U));
  std::memcpy(to, from.data(), sizeof(to));
}

void load(const RayPacket& from, RTCRay8& to) {
  copy(to.org_x, from.ox);
  copy(to.org_y, from.oy);
  copy(to.org_z, from.oz);
  copy(to.dir_x, from.dx);
  copy(to.dir_y, from.dy);
  copy(to.dir_z, from.dz);
  copy(to.tnear, from.near);
  copy(to.tfar, from.far);
  for (int i = 0; i < kPacket; ++i) {
    to.time[i] = 0.0F;
    to.mask[i] = 0xffffffffU;
    to.id[i] = 0;
    to.flags[i] = 0;
  }
}

}  // namespace

struct Tracer::Impl {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
};

Tracer::Tracer() : impl_(std::make_unique<Impl>()) {
  // One thread makes the BVH, and so which of two touching triangles is hit, deterministic.
  impl_->device = rtcNewDevice("threads=1,set_affinity=0");
  if (impl_->device == nullptr)
    throw Error("simulator: the ray tracing library Embree does not start on this machine");
}

Tracer::~Tracer() {
  if (impl_->scene != nullptr) rtcReleaseScene(impl_->scene);
  rtcReleaseDevice(impl_->device);
}

void Tracer::build(const Mesh& mesh, bool changes) {
  if (impl_->scene != nullptr) rtcReleaseScene(impl_->scene);
  impl_->scene = rtcNewScene(impl_->device);
  rtcSetSceneFlags(impl_->scene, RTC_SCENE_FLAG_ROBUST);  // no ray passes between neighbouring triangles
  rtcSetSceneBuildQuality(impl_->scene, changes ? RTC_BUILD_QUALITY_LOW : RTC_BUILD_QUALITY_MEDIUM);
  if (!mesh.triangles.empty()) {
    RTCGeometry geometry = rtcNewGeometry(impl_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    void* positions = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                              sizeof(Vector3f), mesh.positions.size());
    std::memcpy(positions, mesh.positions.data(), mesh.positions.size() * sizeof(Vector3f));
    void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                            sizeof(mesh.triangles[0]), mesh.triangles.size());
    std::memcpy(indices, mesh.triangles.data(), mesh.triangles.size() * sizeof(mesh.triangles[0]));
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(impl_->scene, geometry);
    rtcReleaseGeometry(geometry);
  }
  rtcCommitScene(impl_->scene);
}

void Tracer::intersect(const RayPacket& rays, HitPacket& hits) const {
  RTCRayHit8 packet;
  load(rays, packet.ray);
  for (int i = 0; i < kPacket; ++i) {
    packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  intersect_packet(rays.active.data(), impl_->scene, packet);
  for (std::size_t i = 0; i < kPacket; ++i) {
    const bool met = rays.active[i] != 0 && packet.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
    hits.triangle[i] = met ? packet.hit.primID[i] : kMiss;
    hits.distance[i] = packet.ray.tfar[i];
    hits.u[i] = packet.hit.u[i];
    hits.v[i] = packet.hit.v[i];
  }
}

void Tracer::block(RayPacket& rays) const {
  RTCRay8 packet;
  load(rays, packet);
  occlude_packet(rays.active.data(), impl_->scene, packet);
  for (std::size_t i = 0; i < kPacket; ++i) {
    if (packet.tfar[i] < 0.0F) rays.active[i] = 0;
  }
}

}  // namespace roslam::simulation
