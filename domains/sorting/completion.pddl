; Completes an observed state. For the scene parser only: the planner changes this predicate itself.
; What is neither held nor in a tray stands on the table.
(define (domain sorting)
  (:derived (ontable ?x - item)
    (and (not (holding ?x)) (not (exists (?t - tray) (in ?x ?t))))))
