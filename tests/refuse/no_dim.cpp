// expect: filippov: a system needs `static constexpr int dim` >= 1
#include <filippov/system/system.hpp>

struct NoDim {
    template <class S> S h(const S&, const filippov::Vec<S, 2>&, const filippov::Vec<S, 0>&) const;
};

int main() { filippov::require_system<NoDim>(); }
