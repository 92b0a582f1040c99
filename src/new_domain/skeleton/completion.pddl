; Completes an observed state: what follows from the facts that are seen and felt. For the scene parser only;
; the planner changes these predicates by the effects of actions.
(define (domain NAME)
  (:derived (on-table ?x - block)
    (and (not (holding ?x)) (not (exists (?y - block) (on ?x ?y)))))
  (:derived (clear ?x - block)
    (and (not (holding ?x)) (not (exists (?y - block) (on ?y ?x))))))
