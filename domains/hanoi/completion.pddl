; Completes an observed state. For the scene parser only: the planner changes these predicates itself.
(define (domain hanoi)
  (:derived (clear ?d - disk)
    (not (exists (?above - disk) (on ?above ?d))))
  (:derived (off-peg ?d - disk)
    (not (exists (?p - peg) (on-peg ?d ?p)))))
