// expect: filippov: a system needs `static constexpr int dim` >= 1
#include <filippov/system/system.hpp>

struct DimZero {
    static constexpr int dim = 0;
    template <class S>
    filippov::Vec<S, 0> f1(const S&, const filippov::Vec<S, 0>&, const filippov::Vec<S, 0>&) const;
    template <class S>
    filippov::Vec<S, 0> f2(const S&, const filippov::Vec<S, 0>&, const filippov::Vec<S, 0>&) const;
    template <class S> S h(const S&, const filippov::Vec<S, 0>&, const filippov::Vec<S, 0>&) const;
};

int main() { filippov::require_system<DimZero>(); }
