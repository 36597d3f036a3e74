// SPDX-License-Identifier: BSD-3-Clause
// The step loop does not allocate: the global allocator counts, and Eigen's own asserts.
#define EIGEN_RUNTIME_NO_MALLOC
#include "formulas.hpp"
#include "run.hpp"

#include <filippov/methods/rodas5p.hpp>
#include <filippov/models/oscillator.hpp>
#include <filippov/models/relay.hpp>
#include <filippov/orbits/diagram.hpp>

#include <atomic>
#include <cstdlib>
#include <new>

namespace {

std::atomic<long long> allocations{0};

void* counted(std::size_t size) {
    ++allocations;
    if (void* p = std::malloc(size > 0 ? size : 1))
        return p;
    throw std::bad_alloc();
}
void* counted(std::size_t size, std::align_val_t align) {
    ++allocations;
    const std::size_t a = static_cast<std::size_t>(align);
    if (void* p = std::aligned_alloc(a, (size + a - 1) / a * a))
        return p;
    throw std::bad_alloc();
}

} // namespace

void* operator new(std::size_t size) { return counted(size); }
void* operator new[](std::size_t size) { return counted(size); }
void* operator new(std::size_t size, std::align_val_t align) { return counted(size, align); }
void* operator new[](std::size_t size, std::align_val_t align) { return counted(size, align); }
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
    return ++allocations, std::malloc(size > 0 ? size : 1);
}
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept {
    return ++allocations, std::malloc(size > 0 ? size : 1);
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete[](void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
void operator delete[](void* p, std::size_t) noexcept { std::free(p); }
void operator delete(void* p, std::align_val_t) noexcept { std::free(p); }
void operator delete[](void* p, std::align_val_t) noexcept { std::free(p); }
void operator delete(void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }
void operator delete[](void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }

using namespace filippov;

namespace {

/// Allocations while `work` runs; Eigen's stop the program.
template <class Work> long long allocated(Work work) {
    const long long before = allocations;
    Eigen::internal::set_is_malloc_allowed(false);
    work();
    Eigen::internal::set_is_malloc_allowed(true);
    return allocations - before;
}

template <class Tableau, class Sys>
void check(const Sys& sys, const Vec<double, dim_v<Sys>>& x0, double t_end) {
    constexpr int N = dim_v<Sys>;
    auto settings = tolerance<N>(1e-9);
    settings.closed_form_slides = GENERATE(true, false);
    settings.first_step = 3; // far too long: to be rejected
    const auto p = all_params<double>(sys, default_values(sys));
    EventLog<double, N, 1> log;
    log.events.reserve(1000);
    Counters counters;
    Status status = Status::ok;
    const long long with_log = allocated([&] {
        const auto r = flow<Tableau>(sys, p, x0, 0, t_end, settings, log);
        counters = r.counters;
        status = r.status;
    });
    CHECK(with_log == 0);
    // the run did what could allocate: steps, rejections, root searches, landings, slides
    CHECK(status == Status::ok);
    CHECK(counters.steps > 100);
    CHECK(counters.rejected > 0);
    CHECK(counters.landings > 10);
    CHECK(log.events.size() > 10);
}

} // namespace

TEST_CASE("no_allocation: the counter counts", "[no_allocation]") {
    [[maybe_unused]] static const void* volatile seen; // or a compiler leaves out what nobody sees
    long long n = allocated([] {
        const std::vector<int> v(3);
        seen = v.data();
    });
    CHECK(n == 1);
    n = allocated([] {
        const int* one = new int(1);
        seen = one;
        delete one;
    });
    CHECK(n == 1);
    n = allocated([] {
        struct alignas(64) Wide {
            double x[8];
        };
        const Wide* one = new Wide;
        seen = one;
        delete one;
    });
    CHECK(n == 1);
}

TEMPLATE_TEST_CASE("no_allocation: a run into a log with room allocates nothing", "[no_allocation]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    check<TestType>(models::Oscillator{}, Vec<double, 2>(0, 0), 100);
}

TEST_CASE("no_allocation: a run of formulas allocates nothing", "[no_allocation]") {
    const auto formulas = tests::tape_system<2>(tests::oscillator_formulas());
    check<DormandPrince5>(formulas, Vec<double, 2>(0, 0), 100);
}

TEST_CASE("no_allocation: a run with integrated slides allocates nothing", "[no_allocation]") {
    check<DormandPrince5>(models::Relay{}, Vec<double, 3>(0, -0.001, -0.02), 20);
}

TEST_CASE("no_allocation: a run that keeps nothing allocates nothing", "[no_allocation]") {
    const auto p = default_params<models::Oscillator>();
    const Vec<double, 2> x0(0, 0);
    const auto settings = tolerance<2>(1e-9);
    long long events = 0;
    const long long n = allocated([&] {
        events =
            flow<DormandPrince5>(models::Oscillator{}, p, x0, 0, 100, settings).counters.events;
    });
    CHECK(n == 0);
    CHECK(events > 10);
}

TEST_CASE("no_allocation: the transient of a diagram allocates nothing", "[no_allocation]") {
    const auto p = default_params<models::Oscillator>();
    const double T = models::Oscillator{}.period(p);
    const auto settings = tolerance<2>(1e-9);
    const Vec<double, 2> x0(0, 0);
    DiagramSection section;
    section.strobe = GENERATE(false, true);
    const bool skip = GENERATE(false, true);
    std::vector<DiagramPoint<double, 2>> points;
    const auto transient = [&](double periods) {
        DiagramRecorder<double, 2, 1> recorder(section, T, periods, skip, points);
        return flow<DormandPrince8>(models::Oscillator{}, p, x0, 0, 200 * T, settings, recorder)
            .counters.events;
    };
    long long events = 0;
    CHECK(allocated([&] { events = transient(200); }) == 0);
    CHECK(points.empty());
    CHECK(events > 10);
    points.reserve(1000);
    CHECK(allocated([&] { transient(100); }) == 0); // with room, what is kept allocates nothing
    CHECK(points.size() >= 25);
}

TEST_CASE("no_allocation: a run that fails allocates nothing", "[no_allocation]") {
    const auto p = default_params<models::Oscillator>();
    auto settings = tolerance<2>(1e-9);
    settings.max_steps = 50;
    Status status = Status::ok;
    const Vec<double, 2> x0(0, 0);
    const long long n = allocated([&] {
        status = flow<DormandPrince5>(models::Oscillator{}, p, x0, 0, 100, settings).status;
    });
    CHECK(n == 0);
    CHECK(status == Status::max_steps);
}
