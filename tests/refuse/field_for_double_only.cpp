// expect: `f1` and `f2` (or `region`, or `field`) must be templates over the scalar S, so that they
// can be differentiated
#include <filippov/engine/flow.hpp>

template <class S, int N> using Vec = filippov::Vec<S, N>;

struct FieldForDoubleOnly {
    static constexpr int dim = 2;
    Vec<double, 2> f1(const double&, const Vec<double, 2>& x, const Vec<double, 0>&) const {
        return {x[1], 1};
    }
    Vec<double, 2> f2(const double&, const Vec<double, 2>& x, const Vec<double, 0>&) const {
        return {x[1], -1};
    }
    template <class S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const { return x[1]; }
};

int main() {
    filippov::EventLog<double, 2, 1> log;
    return static_cast<int>(filippov::flow(FieldForDoubleOnly{}, Vec<double, 0>(),
                                           Vec<double, 2>(0, 0), 0, 1,
                                           filippov::Settings<double, 2>{}, log)
                                .status);
}
