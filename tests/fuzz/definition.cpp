// SPDX-License-Identifier: BSD-3-Clause
// Bytes become a right-hand side, which is recorded, split, written as tapes and run: an entry
// point for a fuzzer that looks at coverage (libFuzzer). `main.cpp` calls it with random bytes.
//
// What it checks: formulas are refused or right. Each one is computed a second time, operation by
// operation as it was written, with a bound of its rounding; the graph, the region on which a point
// lies, and the tapes have to agree within that. Runs end within their limits with a status that is
// true, the same again to the bit, in lanes too.
#include "check.hpp"

#include <filippov/engine/flow.hpp>
#include <filippov/ensemble/ensemble.hpp>
#include <filippov/formulas/switch_formulas.hpp>
#include <filippov/formulas/tape_system.hpp>
#include <filippov/methods/dormand_prince8.hpp>
#include <filippov/methods/rodas5p.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

namespace {

using namespace filippov;
using Long = long double;

constexpr int dim = 2, n_params = 2;
constexpr double inf = std::numeric_limits<double>::infinity();

/// What a fuzzer gives, read from the front; zeros where it ends.
class Bytes {
public:
    Bytes(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}
    bool empty() const { return left_ == 0; }
    std::uint8_t byte() {
        if (left_ == 0)
            return 0;
        --left_;
        return *data_++;
    }
    std::size_t below(std::size_t n) { return byte() % n; }
    /// Plain numbers mostly, now and then any eight bytes.
    double number() {
        const std::uint8_t kind = byte();
        if (kind < 200)
            return (int(kind) - 100) / 16.0;
        if (kind < 240)
            return std::ldexp(1.0 + byte() / 256.0, int(byte()) - 128);
        std::uint64_t bits = 0;
        for (int k = 0; k < 8; ++k)
            bits = bits << 8 | byte();
        double value;
        std::memcpy(&value, &bits, sizeof value);
        return value;
    }

private:
    const std::uint8_t* data_;
    std::size_t left_;
};

// --- the second computation ----------------------------------------------------------------------

/// A number and how far off double precision may have it; infinitely far, if nothing can be said.
struct Sure {
    Long value = 0;
    Long error = 0;
};
bool known(const Sure& a) { return a.error < std::numeric_limits<Long>::infinity(); }
Sure nothing() { return {0, std::numeric_limits<Long>::infinity()}; }

/// Rounds as doubles of moderate size do. Formulas may be rewritten where no number on the way
/// over- or underflows.
Sure rounded(Long value, Long error) {
    const Long size = std::abs(value);
    if (!(size == 0 || (size > 1e-60L && size < 1e60L)) || !(error < 1e60L))
        return nothing();
    return {value, error + 0x1p-50L * size};
}
template <class F> Sure through(const Sure& a, const F& f) {
    if (!(a.error < 1e-3L)) // f may turn in between, as a sine does: its ends bound nothing
        return nothing();
    const Long value = f(a.value);
    const Long error =
        std::max(std::abs(f(a.value + a.error) - value), std::abs(f(a.value - a.error) - value));
    return known(a) && std::isfinite(error) ? rounded(value, 2 * error) : nothing();
}
Sure sign_of(const Sure& a) {
    // a double that is zero to rounding may have any sign
    if (!known(a) || std::abs(a.value) <= 4 * a.error)
        return nothing();
    return {a.value > 0 ? Long(1) : Long(-1), 0};
}
Sure times(const Sure& a, const Sure& b) {
    if (!known(a) || !known(b))
        return nothing();
    return rounded(a.value * b.value,
                   std::abs(a.value) * b.error + std::abs(b.value) * a.error + a.error * b.error);
}
Sure over(const Sure& a, const Sure& b) {
    if (!known(a) || !known(b) || std::abs(b.value) <= 4 * b.error)
        return nothing();
    const Long least = std::abs(b.value) - b.error;
    return rounded(a.value / b.value,
                   a.error / least + std::abs(a.value) * b.error / (std::abs(b.value) * least));
}
Sure plus(const Sure& a, const Sure& b, int sign) {
    if (!known(a) || !known(b))
        return nothing();
    // what is summed may be summed in another order
    return rounded(a.value + sign * b.value,
                   a.error + b.error + 0x1p-50L * (std::abs(a.value) + std::abs(b.value)));
}
Sure power(const Sure& a, const Sure& b) {
    if (!known(a) || !known(b) || !(a.value > 2 * a.error))
        return nothing();
    const Sure logarithm = times(b, through(a, [](Long v) { return std::log(v); }));
    return known(logarithm) ? through(logarithm, [](Long v) { return std::exp(v); }) : nothing();
}

/// A formula and its values at some points.
struct Formula {
    Expr e = -1;
    std::vector<Sure> at;
};

struct Point {
    double t;
    std::array<double, dim> x;
    std::array<double, n_params> p;
};

// --- what the bytes write ------------------------------------------------------------------------

class Author {
public:
    Author(Bytes& bytes, Graph& graph) : bytes_(bytes), graph_(graph) {
        for (int k = 0; k < n_params; ++k)
            defaults_.push_back(finite(bytes_.number()));
        for (int k = 0; k < 6; ++k) {
            const auto one = [&](double size) {
                return size * (int(bytes_.byte()) - 127.5) / 127.5;
            };
            points_.push_back({one(5), {one(3), one(3)}, {defaults_[0], defaults_[1]}});
        }
    }
    const std::vector<double>& defaults() const { return defaults_; }
    const std::vector<Point>& points() const { return points_; }

    /// So many formulas: an operation a byte or two, on what was made before.
    std::vector<Formula> write(std::size_t outputs) {
        leaf(graph_.time(), [](const Point& p) { return p.t; });
        for (int i = 0; i < dim; ++i)
            leaf(graph_.state(i), [i](const Point& p) { return p.x[std::size_t(i)]; });
        for (int k = 0; k < n_params; ++k)
            leaf(graph_.param(k), [k](const Point& p) { return p.p[std::size_t(k)]; });
        leaf(graph_.constant(1), [](const Point&) { return 1.0; });
        for (int k = 0; k < 40 && !bytes_.empty(); ++k)
            operation();
        std::vector<Formula> last;
        for (std::size_t k = 0; k < outputs; ++k)
            last.push_back(all_[all_.size() - 1 - k]);
        return last;
    }

private:
    static double finite(double v) { return std::isfinite(v) ? v : 1; }

    template <class F> void leaf(Expr e, const F& value) {
        Formula f{e, {}};
        for (const Point& point : points_)
            f.at.push_back({value(point), 0});
        all_.push_back(f);
    }
    const Formula& any() { return all_[bytes_.below(all_.size())]; }
    template <class F> void one(Expr e, const Formula& a, const F& value) {
        Formula f{e, {}};
        for (const Sure& v : a.at)
            f.at.push_back(value(v));
        all_.push_back(f);
    }
    template <class F> void two(Expr e, const Formula& a, const Formula& b, const F& value) {
        Formula f{e, {}};
        for (std::size_t k = 0; k < a.at.size(); ++k)
            f.at.push_back(value(a.at[k], b.at[k]));
        all_.push_back(f);
    }
    void function(Op op) {
        const Formula a = any();
        one(graph_.unary(op, a.e), a, [&](const Sure& v) {
            return through(v, [op](Long u) -> Long {
                switch (op) {
                case Op::sqrt:
                    return std::sqrt(u);
                case Op::exp:
                    return std::exp(u);
                case Op::log:
                    return std::log(u);
                case Op::sin:
                    return std::sin(u);
                case Op::cos:
                    return std::cos(u);
                case Op::tan:
                    return std::tan(u);
                case Op::asin:
                    return std::asin(u);
                case Op::atan:
                    return std::atan(u);
                case Op::sinh:
                    return std::sinh(u);
                case Op::cosh:
                    return std::cosh(u);
                case Op::tanh:
                    return std::tanh(u);
                case Op::magnitude:
                    return std::abs(u);
                default:
                    return -u;
                }
            });
        });
    }
    void operation() {
        static constexpr std::array functions{Op::sqrt, Op::exp,  Op::log,      Op::sin,  Op::cos,
                                              Op::tan,  Op::asin, Op::atan,     Op::sinh, Op::cosh,
                                              Op::tanh, Op::neg,  Op::magnitude};
        switch (bytes_.below(12)) {
        case 0: {
            const double value = finite(bytes_.number());
            leaf(graph_.constant(value), [value](const Point&) { return value; });
            break;
        }
        case 1:
        case 2: {
            const Formula a = any(), b = any();
            two(graph_.add(a.e, b.e), a, b,
                [](const Sure& u, const Sure& v) { return plus(u, v, 1); });
            break;
        }
        case 3: {
            const Formula a = any(), b = any();
            two(graph_.sub(a.e, b.e), a, b,
                [](const Sure& u, const Sure& v) { return plus(u, v, -1); });
            break;
        }
        case 4:
        case 5: {
            const Formula a = any(), b = any();
            two(graph_.mul(a.e, b.e), a, b, times);
            break;
        }
        case 6: {
            const Formula a = any(), b = any();
            two(graph_.div(a.e, b.e), a, b, over);
            break;
        }
        case 7: {
            const Formula a = any(), b = any();
            two(graph_.pow(a.e, b.e), a, b, power);
            break;
        }
        case 8: {
            const Formula a = any();
            one(graph_.unary(Op::sign, a.e), a, sign_of);
            break;
        }
        case 9: {
            const Formula a = any();
            one(graph_.abs(a.e), a, [](const Sure& v) { return times(v, sign_of(v)); });
            break;
        }
        case 10: {
            const Formula a = any(), b = any(), c = any();
            Formula f{graph_.where(graph_.step(a.e), b.e, c.e), {}};
            for (std::size_t k = 0; k < a.at.size(); ++k) {
                const Sure s = sign_of(a.at[k]);
                f.at.push_back(!known(s) ? nothing() : s.value > 0 ? b.at[k] : c.at[k]);
            }
            all_.push_back(f);
            break;
        }
        default:
            function(functions[bytes_.below(functions.size())]);
        }
    }

    Bytes& bytes_;
    Graph& graph_;
    std::vector<double> defaults_;
    std::vector<Point> points_;
    std::vector<Formula> all_;
};

// --- what is checked -----------------------------------------------------------------------------

void check_value(double value, const Sure& expected) {
    if (known(expected))
        CHECK_THAT(std::abs(Long(value) - expected.value) <= 16 * expected.error + 1e-300L);
}

double value(const Graph& graph, Expr e, const Point& at) {
    return graph.value(e, at.t, at.x, at.p);
}

/// The region of a point; none if it lies on a surface.
std::optional<std::size_t> region_of(const Definition& d, const Point& at) {
    std::size_t code = 0;
    for (std::size_t j = 0; j < d.h.size(); ++j) {
        const double h = value(d.graph, d.h[j], at);
        double size = 0; // how much it changes nearby
        for (int i = 0; i < dim; ++i) {
            Point near = at;
            near.x[std::size_t(i)] += 1e-6;
            size = std::max(size, std::abs(value(d.graph, d.h[j], near) - h));
        }
        if (!(std::abs(h) > size))
            return std::nullopt;
        code |= std::size_t(h > 0) << j;
    }
    return code;
}

template <class System> using State = Vec<double, System::dim>;

/// A run, twice; what it says has to be so.
template <class Tableau, class System>
void check_run(const System& sys, const State<System>& x0, double t_end) {
    Settings<double, System::dim> settings;
    settings.rtol = 1e-5;
    settings.atol = AbsoluteTolerance<double, System::dim>(1e-6);
    settings.max_steps = 150;
    settings.max_events = 60;
    const auto p = all_params<double>(sys, default_values(sys));
    const auto go = [&] { return flow<Tableau>(sys, p, x0, 0.0, t_end, settings); };
    const auto r = go(), again = go();
    CHECK_THAT(r.status == again.status);
    CHECK_THAT(std::memcmp(&r.t, &again.t, sizeof r.t) == 0);
    CHECK_THAT(std::memcmp(r.x.data(), again.x.data(), sizeof r.x) == 0);
    CHECK_THAT(name(r.status) != "");
    if (r.status == Status::ok)
        CHECK_THAT(r.t == t_end && r.x.allFinite());
    else
        CHECK_THAT(!r.message().empty());
    CHECK_THAT(r.t >= 0 && r.t <= t_end);
    CHECK_THAT(r.counters.steps <= settings.max_steps + 1);
}

template <class System>
void check_ensemble(const System& sys, const State<System>& x0, double t_end) {
    Settings<double, System::dim> settings;
    settings.max_steps = 150;
    settings.max_events = 60;
    const auto p = all_params<double>(sys, default_values(sys));
    std::vector<Member<dim, 16>> members;
    for (int k = 0; k < 5; ++k)
        members.push_back({State<System>(x0 * (1 + 0.25 * k)), p, 0.0, t_end});
    const auto r = ensemble<DormandPrince5, 4>(sys, members, settings, Parallel{.threads = 1});
    for (const auto& o : r.outcomes)
        if (o.status == Status::ok)
            CHECK_THAT(o.x.allFinite());
}

template <int M> void check_system(Definition d, double t_end, const Point& start) {
    using System = TapeSystem<dim, M, 16>;
    const System sys(std::make_shared<const TapeProgram>(d, 16));
    const State<System> x0(start.x[0], start.x[1]);
    check_run<DormandPrince5>(sys, x0, t_end);
    check_run<Rodas5P>(sys, x0, t_end);
    if constexpr (M == 1)
        check_ensemble(sys, x0, t_end);
}

void check(Bytes& bytes) {
    Definition d;
    d.dim = dim;
    d.state_names = {"x", "y"};
    d.param_names = {"a", "b"};
    Author author(bytes, d.graph);
    d.defaults = author.defaults();
    const auto field = author.write(dim);
    std::vector<Expr> formulas;
    for (const Formula& f : field)
        formulas.push_back(f.e);
    const auto& points = author.points();
    for (const Formula& f : field)
        for (std::size_t k = 0; k < points.size(); ++k)
            check_value(value(d.graph, f.e, points[k]), f.at[k]);

    Graph other = d.graph; // smoothing is another way to take it apart
    smooth_formulas(other, formulas, SmoothLaw::tanh, other.constant(100));

    split(d, formulas); // refused, maybe
    CHECK_THAT(d.h.size() <= std::size_t(most_split_surfaces));
    CHECK_THAT(d.region.size() == std::size_t(1) << d.h.size());
    for (std::size_t k = 0; k < points.size(); ++k)
        if (const auto code = region_of(d, points[k])) {
            const Tape tape = write_tape(d.graph, d.region[*code]);
            std::array<double, dim> out;
            tape.run(points[k].t, points[k].x.data(), points[k].p.data(), out.data());
            for (std::size_t i = 0; i < dim; ++i) {
                check_value(value(d.graph, d.region[*code][i], points[k]), field[i].at[k]);
                check_value(out[i], field[i].at[k]);
            }
        }
    const double t_end = 0.25 + bytes.byte() / 64.0;
    if (d.surfaces() == 1)
        check_system<1>(d, t_end, points[0]);
    else if (d.surfaces() <= 3)
        check_system<3>(d, t_end, points[0]);
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Bytes bytes(data, size);
    try {
        check(bytes);
    } catch (const std::invalid_argument&) { // refused
    }
    return 0;
}
