// SPDX-License-Identifier: BSD-3-Clause
#include "compiled_model.hpp"

#include <filippov/models/switches.hpp>

namespace filippov::python {

std::shared_ptr<const Model> sign_plane() { return bind_model<models::SignPlane>("sign_plane"); }
std::shared_ptr<const Model> planar_relay() {
    return bind_model<models::PlanarRelay>("planar_relay");
}
std::shared_ptr<const Model> gene_switch() { return bind_model<models::GeneSwitch>("gene_switch"); }

} // namespace filippov::python
